#include "apps/fleet/postgres.hpp"

#include <fmt/format.h>
#include <libpq-fe.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string_view>
#include <utility>

#include "apps/log.hpp"
#include "core/printable.hpp"

namespace hueline::apps {
namespace {

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};
struct ClearResult {
  void operator()(PGresult* result) const { PQclear(result); }
};

/// Makes one line of libpq's several.
std::string in_one_line(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (line.starts_with('\t') || line.starts_with(' ')) line.remove_prefix(1);
    while (line.ends_with('.') || line.ends_with(' ')) line.remove_suffix(1);
    if (!line.empty()) out += (out.empty() ? "" : "; ") + printable(line);
  }
  return out;
}

/// Tells what the server says beside its answers, such as a warning that it is shut down, as messages of the program.
void tell_notice(void*, const PGresult* notice) {
  const char* const text = PQresultErrorField(notice, PG_DIAG_MESSAGE_PRIMARY);
  log_info("the database says: {}", in_one_line(text == nullptr ? "" : text));
}

/// Returns whether a sign @ stands behind the one that ends user and password: then the password has one, or a slash,
/// and libpq takes the end of the password for the host or the database, and shows it in its messages.
bool has_plain_sign_in_password(std::string_view uri) {
  std::string_view rest = uri.substr(uri.find("://") + 3);
  const auto end = rest.find_first_of("@/");
  if (end != std::string_view::npos && rest[end] == '@') rest.remove_prefix(end + 1);
  return rest.substr(0, rest.find('?')).find('@') != std::string_view::npos;
}

/// Returns what to do about an error of the server (PostgreSQL's manual, appendix A), if its reason does not say it.
const char* advice(std::string_view state) {
  if (state == "42501") return "; ask the owner of the schema or of the tables for the right";
  if (state == "25006") return "; name a server that can be written to";
  if (state == "55P03") return ": another program has held the tables for too long; try again";
  return "";
}

Result<std::string> shown_of(const std::string& uri) {
  constexpr const char* kWanted =
      "no address of a database: it is postgresql://USER@HOST:PORT/DATABASE, in which a password's signs : / ? @ % are "
      "written as %3A %2F %3F %40 %25";
  if (has_plain_sign_in_password(uri)) return Error{ErrorCode::Invalid, kWanted};
  char* raw = nullptr;
  const std::unique_ptr<PQconninfoOption, FreeOptions> options(PQconninfoParse(uri.c_str(), &raw));
  if (options == nullptr) {
    // The reason ends with the part of the address that is wrong, which may be the password.
    std::string reason = in_one_line(raw == nullptr ? "" : raw);
    PQfreemem(raw);
    reason.resize(std::min(reason.find(": \""), reason.size()));
    return Error{ErrorCode::Invalid, fmt::format("{} ({})", kWanted, reason)};
  }
  std::map<std::string_view, std::string> given;
  for (const PQconninfoOption* one = options.get(); one->keyword != nullptr; ++one)
    if (one->val != nullptr) given[one->keyword] = one->val;
  // An address without a host, USER:PASSWORD/DATABASE, has the password where the port should be.
  if (given["port"].find_first_not_of("0123456789,") != std::string::npos) return Error{ErrorCode::Invalid, kWanted};
  std::string out = "postgresql://";
  if (!given["user"].empty()) out += given["user"] + "@";
  const bool is_socket = given["host"].starts_with('/');
  if (!is_socket) out += given["host"].empty() ? given["hostaddr"] : given["host"];
  if (!given["port"].empty()) out += ":" + given["port"];
  out += "/" + given["dbname"];
  if (is_socket) out += "?host=" + given["host"];
  return printable(out);
}

}  // namespace

bool PostgresAddress::is_meant(const std::string& text) {
  return text.starts_with("postgresql://") || text.starts_with("postgres://");
}

Result<PostgresAddress> PostgresAddress::parse(const std::string& uri) {
  auto shown = shown_of(uri);
  if (!shown.ok()) return shown.error();
  PostgresAddress out;
  out.uri_ = uri;
  out.shown_ = std::move(*shown);
  return out;
}

void Postgres::Close::operator()(pg_conn* connection) const { PQfinish(connection); }

Postgres::Postgres(std::unique_ptr<pg_conn, Close> connection, std::string shown)
    : connection_(std::move(connection)), shown_(std::move(shown)) {}

Result<Postgres> Postgres::connect(const PostgresAddress& address) {
  // What stands before the address holds if the address does not say otherwise. A null ends the list.
  std::vector<std::pair<const char*, const char*>> settings{{"fallback_application_name", "hueline"},
                                                            {"keepalives_idle", "15"},
                                                            {"keepalives_interval", "5"},
                                                            {"keepalives_count", "3"},
                                                            {"tcp_user_timeout", "30000"}};
  if (std::getenv("PGCONNECT_TIMEOUT") == nullptr) settings.emplace_back("connect_timeout", "10");
  settings.emplace_back("dbname", address.uri().c_str());
  settings.emplace_back("client_encoding", "UTF8");
  settings.emplace_back(nullptr, nullptr);
  std::vector<const char*> names, values;
  for (const auto& [name, value] : settings) {
    names.push_back(name);
    values.push_back(value);
  }
  std::unique_ptr<pg_conn, Close> connection(PQconnectdbParams(names.data(), values.data(), 1));
  if (connection == nullptr) return Error{ErrorCode::Unavailable, "no memory for a connection to a database"};
  if (PQstatus(connection.get()) != CONNECTION_OK)
    return Error{ErrorCode::Unavailable,
                 fmt::format("{}: {}", address.shown(), in_one_line(PQerrorMessage(connection.get())))};
  PQsetNoticeReceiver(connection.get(), tell_notice, nullptr);
  return Postgres(std::move(connection), address.shown());
}

Result<std::vector<Postgres::Row>> Postgres::ask(const std::string& sql, const std::vector<Value>& parameters) {
  std::vector<const char*> values;
  for (const Value& one : parameters) values.push_back(one ? one->c_str() : nullptr);
  const std::unique_ptr<PGresult, ClearResult> result(PQexecParams(
      connection_.get(), sql.c_str(), static_cast<int>(values.size()), nullptr, values.data(), nullptr, nullptr, 0));
  const ExecStatusType status = PQresultStatus(result.get());
  if (PQstatus(connection_.get()) != CONNECTION_OK)
    return Error{ErrorCode::Disconnected, fmt::format("{}: the connection was lost: {}", shown_,
                                                      in_one_line(PQerrorMessage(connection_.get())))};
  if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) {
    const char* const state = PQresultErrorField(result.get(), PG_DIAG_SQLSTATE);
    const char* const reason = PQresultErrorField(result.get(), PG_DIAG_MESSAGE_PRIMARY);
    return Error{
        std::string_view(state == nullptr ? "" : state) == "42P10" ? ErrorCode::Invalid : ErrorCode::Io,
        fmt::format("{}: {}{}", shown_, in_one_line(reason == nullptr ? PQerrorMessage(connection_.get()) : reason),
                    advice(state == nullptr ? "" : state))};
  }
  std::vector<Row> out(static_cast<std::size_t>(PQntuples(result.get())));
  for (int row = 0; row < PQntuples(result.get()); ++row)
    for (int column = 0; column < PQnfields(result.get()); ++column)
      out[static_cast<std::size_t>(row)].push_back(
          PQgetisnull(result.get(), row, column) != 0 ? Value() : Value(PQgetvalue(result.get(), row, column)));
  return out;
}

}  // namespace hueline::apps
