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

/// The database failed: its text names the file and the cause. The transaction under way has changed nothing.
class DatabaseError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// In place of a file: the database is in the memory of this process, and ends with its connection.
inline constexpr const char* kInMemory = ":memory:";

/// One connection to an SQLite file, for one thread at a time. Everything here throws DatabaseError.
class Database {
 public:
  /// Makes the file, mode 0600, where it is not there. A commit is on the disk when it returns; a locked file
  /// is waited for, 5 s.
  explicit Database(const std::filesystem::path& file);

  /// Carries out statements without parameters and results.
  void run(const char* sql);
  /// The number of rows that the last statement changed.
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

/// One statement with its parameters $1, $2 and so on: std::int64_t, int, double, text, or an optional int,
/// which is NULL where it has no value.
class Statement {
 public:
  Statement(Database& database, const char* sql);
  template <class... Values>
  Statement(Database& database, const char* sql, const Values&... values) : Statement(database, sql) {
    int number = 0;
    (bind(++number, values), ...);
  }

  /// Goes to the next row; false after the last one.
  bool next();
  /// The present row's columns, counted from 0.
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

/// Begins a transaction, which ends without effect unless it is committed.
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
