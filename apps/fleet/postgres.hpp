#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

struct pg_conn;

namespace hueline::apps {

/// The address of a database: a connection URI of libpq (PostgreSQL's manual, 34.1.1.2). It may hold a password, so it
/// is never shown: shown() is.
class PostgresAddress {
 public:
  /// Returns whether a user means an address of PostgreSQL: it begins with postgresql:// or postgres://.
  static bool is_meant(const std::string& text);
  /// Errors: Invalid if it is no such URI. The message repeats nothing that could be a password.
  static Result<PostgresAddress> parse(const std::string& uri);

  const std::string& uri() const { return uri_; }
  /// Returns user, host, port and database, for messages.
  const std::string& shown() const { return shown_; }

 private:
  std::string uri_, shown_;
};

/// A connection to a PostgreSQL server. What a transaction has not committed when this ends is undone by the server.
/// Thread safety: none.
class Postgres {
 public:
  /// A value as text; nothing is NULL.
  using Value = std::optional<std::string>;
  using Row = std::vector<Value>;

  /// Connects. Gives up after 10 s if neither the address nor PGCONNECT_TIMEOUT says otherwise, and takes a connection
  /// for lost that has not answered for about half a minute. Errors: Unavailable with libpq's reason.
  static Result<Postgres> connect(const PostgresAddress& address);

  /// Runs one statement, in which $1 stands for the first parameter, and returns its rows. Errors, with the address and
  /// the server's reason: Disconnected if the connection is lost; Invalid if a unique key is missing that the
  /// statement relies on; otherwise Io.
  Result<std::vector<Row>> ask(const std::string& sql, const std::vector<Value>& parameters = {});

 private:
  struct Close {
    void operator()(pg_conn* connection) const;
  };
  Postgres(std::unique_ptr<pg_conn, Close> connection, std::string shown);

  std::unique_ptr<pg_conn, Close> connection_;
  std::string shown_;
};

}  // namespace hueline::apps
