// SPDX-License-Identifier: Apache-2.0
#include "cell/store/database.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace corbot::cell {
namespace {

constexpr int kBusyTimeout_ms = 5000;

/// Creates the file for this user only, since SQLite would make it readable for others. Does not open an
/// existing file: closing it would release the locks of this process's other connections.
void make_private_file(const std::string& file) {
  const int fd = ::open(file.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0600);
  if (fd < 0 && errno != EEXIST) throw DatabaseError(fmt::format("{}: {}", file, std::strerror(errno)));
  if (fd >= 0) ::close(fd);
}

}  // namespace

void Database::Close::operator()(sqlite3* connection) const { sqlite3_close(connection); }

Database::Database(const std::filesystem::path& file) : file_(file.string()) {
  const bool is_in_memory = file_ == kInMemory;
  if (!is_in_memory) make_private_file(file_);
  sqlite3* connection = nullptr;
  const int code =
      sqlite3_open_v2(file_.c_str(), &connection, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
  connection_.reset(connection);
  check(code);
  check(sqlite3_busy_timeout(connection, kBusyTimeout_ms));
  Statement mode(*this, "PRAGMA journal_mode = WAL");
  if (!mode.next() || mode.text(0) != (is_in_memory ? "memory" : "wal"))
    throw DatabaseError(file_ + ": its file system does not support a write-ahead log");
  run("PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
}

void Database::check(int code) const {
  if (code == SQLITE_OK) return;
  throw DatabaseError(
      fmt::format("{}: {}", file_, connection_ ? sqlite3_errmsg(connection_.get()) : sqlite3_errstr(code)),
      (code & 0xFF) == SQLITE_FULL);
}

void Database::run(const char* sql) {
  check(sqlite3_exec(connection_.get(), sql, nullptr, nullptr, nullptr));
}

int Database::changed_rows() const { return sqlite3_changes(connection_.get()); }

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Statement::Statement(Database& database, const char* sql) : database_(database) {
  sqlite3_stmt* statement = nullptr;
  database.check(sqlite3_prepare_v2(database.connection_.get(), sql, -1, &statement, nullptr));
  statement_.reset(statement);
}

bool Statement::next() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  database_.check(code == SQLITE_DONE ? SQLITE_OK : code);
  return false;
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
double Statement::number(int column) const { return sqlite3_column_double(statement_.get(), column); }
bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}
std::string Statement::text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_.get(), column);
  return text == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(text));
}

/// Returns SQLite's index of a parameter: SQLite treats $3 as a name, and numbers names by first use. A
/// missing parameter has the index 0, which bind() refuses.
int Statement::index_of(int number) const {
  return sqlite3_bind_parameter_index(statement_.get(), fmt::format("${}", number).c_str());
}
void Statement::bind(int number, std::int64_t value) {
  database_.check(sqlite3_bind_int64(statement_.get(), index_of(number), value));
}
void Statement::bind(int number, double value) {
  database_.check(sqlite3_bind_double(statement_.get(), index_of(number), value));
}
void Statement::bind(int number, std::string_view value) {
  database_.check(sqlite3_bind_text(statement_.get(), index_of(number), value.data(),
                                    static_cast<int>(value.size()), SQLITE_TRANSIENT));
}
void Statement::bind(int number, std::optional<int> value) {
  if (value) return bind(number, *value);
  database_.check(sqlite3_bind_null(statement_.get(), index_of(number)));
}

Transaction::Transaction(Database& database) : database_(database) { database.run("BEGIN"); }

Transaction::~Transaction() {
  if (sqlite3_get_autocommit(database_.connection_.get()) == 0)
    sqlite3_exec(database_.connection_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() { database_.run("COMMIT"); }

}  // namespace corbot::cell
