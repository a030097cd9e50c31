// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace corbot::cell {

/// The database failed. The text names the file and the cause. The current transaction has changed nothing.
class DatabaseError : public std::runtime_error {
 public:
  explicit DatabaseError(const std::string& text, bool is_full = false)
      : std::runtime_error(text), is_full_(is_full) {}
  /// Tells if the disk has no space left.
  [[nodiscard]] bool is_full() const noexcept { return is_full_; }

 private:
  bool is_full_;
};

/// The path of a database in this process's memory, which ends with its connection.
inline constexpr const char* kInMemory = ":memory:";

/// One connection to an SQLite file, for one thread at a time. All functions throw DatabaseError.
class Database {
 public:
  /// Opens the file, and creates it with mode 0600 if necessary. A commit returns when it is on the disk.
  /// Calls wait up to 5 s for a locked file.
  explicit Database(const std::filesystem::path& file);

  /// Carries out SQL statements without parameters and results.
  void run(const char* sql);
  /// Returns the number of rows that the last statement changed.
  [[nodiscard]] int changed_rows() const;

 private:
  friend class Statement;
  friend class Transaction;
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  /// Throws unless `code` is SQLITE_OK.
  void check(int code) const;

  std::string file_;
  std::unique_ptr<sqlite3, Close> connection_;
};

/// One statement with its parameters $1, $2 and so on. A parameter is a std::int64_t, int, double, text, or
/// optional int; an empty optional is NULL.
class Statement {
 public:
  Statement(Database& database, const char* sql);
  template <class... Values>
  Statement(Database& database, const char* sql, const Values&... values) : Statement(database, sql) {
    int number = 0;
    (bind(++number, values), ...);
  }

  /// Steps to the next row. Returns false after the last one.
  bool next();
  /// Return the current row's columns, counted from 0.
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double number(int column) const;
  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] bool is_null(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  [[nodiscard]] int index_of(int number) const;
  void bind(int number, std::int64_t value);
  void bind(int number, int value) { bind(number, std::int64_t{value}); }
  void bind(int number, double value);
  void bind(int number, std::string_view value);
  void bind(int number, const std::string& value) { bind(number, std::string_view(value)); }
  void bind(int number, const char* value) { bind(number, std::string_view(value)); }
  void bind(int number, std::optional<int> value);

  Database& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// Carries out a statement that has no result. Returns the number of rows that it changed.
template <class... Values>
int execute(Database& database, const char* sql, const Values&... values) {
  Statement(database, sql, values...).next();
  return database.changed_rows();
}

/// A transaction. The destructor rolls it back unless commit() was called.
class Transaction {
 public:
  explicit Transaction(Database& database);
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();
  void commit();

 private:
  Database& database_;
};

}  // namespace corbot::cell
