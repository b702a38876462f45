#include "console/server/api.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "console/server/json_fields.hpp"
#include "core/json_text.hpp"
#include "core/printable.hpp"

namespace hueline::console {
namespace {

using nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::uintmax_t kMostFile = 64'000'000;
constexpr const char* kNoUsers =
    "there are no users yet: make one on this computer with `hueline-console user add NAME --role operator`";

Answer json_answer(const ordered_json& json, unsigned status = 200) {
  Answer out;
  out.status = status;
  out.body = json_text(json);
  return out;
}

std::string header(const Request& request, const std::string& name) {
  const auto found = request.headers.find(name);
  return found == request.headers.end() ? std::string() : found->second;
}

/// Returns the value of a cookie.
std::string cookie(const Request& request, std::string_view name) {
  const std::string all = header(request, "cookie");
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t end = std::min(all.find(';', at), all.size());
    std::string_view one = std::string_view(all).substr(at, end - at);
    one.remove_prefix(std::min(one.find_first_not_of(' '), one.size()));
    if (one.starts_with(name) && one.substr(name.size()).starts_with('='))
      return std::string(one.substr(name.size() + 1));
    at = end + 1;
  }
  return {};
}

std::string cookie_header(const Request& request, const std::string& secret, int seconds) {
  return fmt::format("hueline_session={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}{}", secret, seconds,
                     request.is_secure ? "; Secure" : "");
}

/// Returns the token with which a program opens a WebSocket, if it gives one.
std::optional<std::string> token_of(const Request& request) {
  constexpr std::string_view kToken = "token=";
  const std::size_t at = request.query.find(kToken);
  return at == std::string::npos ? std::nullopt : std::optional(request.query.substr(at + kToken.size(), 64));
}

Answer file_answer(const fs::path& path, const char* type) {
  std::error_code failed;
  const auto size = fs::file_size(path, failed);
  if (failed || size > kMostFile) return refuse(404, "there is no such file, or it is too large");
  std::ifstream in(path, std::ios::binary);
  Answer out;
  out.type = type;
  out.body.assign(std::istreambuf_iterator<char>(in), {});
  if (!in) return refuse(500, "the file cannot be read");
  return out;
}

unsigned status_of(const Error& error) {
  switch (error.code) {
    case ErrorCode::Invalid:
    case ErrorCode::Malformed:
      return 400;
    case ErrorCode::Unavailable:
      return 409;
    default:
      return 500;
  }
}

/// Reads the body of a request: an object whose values are texts, numbers or nothing.
std::optional<ordered_json> body_of(const Request& request) {
  const auto flat = [](int depth, auto, auto&) { return depth < 2; };
  if (request.body.empty()) return ordered_json::object();
  ordered_json json = ordered_json::parse(request.body, flat, false);
  if (!json.is_object()) return {};
  return json;
}

}  // namespace

Answer refuse(unsigned status, const std::string& text) { return json_answer({{"error", text}}, status); }

Api::Api(DriveControl& drive, fs::path page, fs::path users, std::optional<MapTiles> tiles)
    : drive_(drive), page_(std::move(page)), users_file_(std::move(users)), tiles_(std::move(tiles)) {}

const Users& Api::users() {
  std::error_code failed;
  const auto time = fs::last_write_time(users_file_, failed);
  if (failed) {
    users_ = {};
    users_read_ = {};  // the same file may come back
  } else if (time != users_read_) {
    users_read_ = time;
    // A file that somebody is mending by hand takes nobody's session away.
    if (auto read = Users::load(users_file_); read.ok()) users_ = std::move(*read);
  }
  return users_;
}

bool Api::is_own_origin(const Request& request) {
  const std::string origin = header(request, "origin");
  if (origin.empty()) return true;
  return origin == (request.is_secure ? "https://" : "http://") + header(request, "host");
}

const Session* Api::session_of(const Request& request) {
  const std::string secret = cookie(request, "hueline_session");
  const Session* session = sessions_.find(secret, Sessions::Clock::now());
  if (session == nullptr) return nullptr;
  // Who was removed, or has got another password or role, has no session any more.
  const User* user = users().find(session->name);
  if (user != nullptr && user->role == session->role && user->password_hash == session->password_hash) return session;
  sessions_.end(secret);
  return nullptr;
}

void Api::answer(const Request& request, const Answered& answered) {
  if (!request.path.starts_with("/api/")) return answered(page_file(request));
  if (request.method != "GET" && request.method != "POST")
    return answered(refuse(405, "the console answers GET and POST only"));
  if (request.method == "POST") {
    if (!is_own_origin(request)) return answered(refuse(403, "the request comes from another page"));
    if (!header(request, "content-type").starts_with("application/json"))
      return answered(refuse(415, "the body must be application/json"));
    if (request.path == "/api/login") return answered(log_in(request));
  }
  const Session* session = session_of(request);
  if (session == nullptr) return answered(users().are_none() ? refuse(503, kNoUsers) : refuse(401, "log in first"));
  if (request.method == "GET") return answered(get(request, *session));
  if (!are_same(header(request, "x-csrf"), session->csrf))
    return answered(refuse(403, "the header X-Csrf is not that of the session: load the page again"));
  post(request, *session, answered);
}

Answer Api::log_in(const Request& request) {
  const auto now = Sessions::Clock::now();
  if (users().are_none()) return refuse(503, kNoUsers);
  if (const int wait = limit_.wait_s(request.address, now); wait > 0) {
    Answer out = refuse(429, fmt::format("too many wrong passwords: try again in {} s", wait));
    out.headers["Retry-After"] = std::to_string(wait);
    return out;
  }
  const auto body = body_of(request);
  if (!body) return refuse(400, "the body must be a JSON object with name and password");
  const User* user = users_.check(text_in(*body, "name"), text_in(*body, "password"));
  if (user == nullptr) {
    limit_.note_failure(request.address, now);
    return refuse(401, "the name or the password is wrong");
  }
  const std::string secret = sessions_.begin(*user, now);
  const Session* session = sessions_.find(secret, now);
  Answer out = json_answer({{"name", user->name}, {"role", name(user->role)}, {"csrf", session->csrf}});
  // The session ends here, when it is not used; its cookie would end while somebody looks at the page.
  constexpr std::chrono::seconds kCookie = std::chrono::days(400);
  out.headers["Set-Cookie"] = cookie_header(request, secret, static_cast<int>(kCookie.count()));
  return out;
}

Answer Api::get(const Request& request, const Session& session) {
  if (request.path == "/api/session")
    return json_answer({{"name", session.name}, {"role", name(session.role)}, {"csrf", session.csrf}});
  if (request.path == "/api/state") return json_answer(drive_.state_json());
  if (request.path == "/api/rigs") {
    auto rigs = ordered_json::array();
    for (const std::string& name : drive_.places().rig_names()) rigs.push_back({{"name", name}, {"from", "folder"}});
    return json_answer({{"rigs", rigs}});
  }
  if (request.path == "/api/check") return json_answer(drive_.check_json());
  if (request.path == "/api/drives") return json_answer(drive_.places().drives_json(drive_.feed().parent_path()));
  if (request.path == "/api/tiles") return json_answer({{"tiles", tiles_ ? tiles_->json() : ordered_json()}});
  constexpr std::string_view kTiles = "/api/tiles/";
  if (request.path.starts_with(kTiles)) return tile(std::string_view(request.path).substr(kTiles.size()));
  constexpr std::string_view kDrives = "/api/drives/";
  if (!request.path.starts_with(kDrives)) return refuse(404, "there is no such call");
  const std::string rest = request.path.substr(kDrives.size());
  const std::size_t slash = rest.find('/');
  const std::string file = slash == std::string::npos ? "" : rest.substr(slash + 1);
  const char* const type = file == "summary.json"  ? "application/json"
                           : file == "report.html" ? "text/html; charset=utf-8"
                           : file == "report.pdf"  ? "application/pdf"
                                                   : nullptr;
  if (type == nullptr) return refuse(404, "there is no such file");
  const auto path = drive_.places().file_of(percent_decoded(rest.substr(0, slash)), file);
  if (!path.ok()) return refuse(path.error().code == ErrorCode::Invalid ? 400 : 404, path.error().message);
  Answer out = file_answer(*path, type);
  // The report has its style inside, and no script.
  if (file == "report.html" && out.status == 200)
    out.headers["Content-Security-Policy"] =
        "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'; sandbox";
  return out;
}

Answer Api::tile(std::string_view place) const {
  if (!tiles_) return refuse(404, "the console has been started without map tiles: --tiles FOLDER");
  const auto file = tiles_->tile(place);
  if (!file.ok()) return refuse(file.error().code == ErrorCode::Invalid ? 400 : 404, file.error().message);
  Answer out = file_answer(file->path, file->type);
  if (out.status == 200) out.headers["Cache-Control"] = "private, max-age=86400";
  return out;
}

void Api::post(const Request& request, const Session& session, const Answered& answered) {
  const auto body = body_of(request);
  if (!body) return answered(refuse(400, "the body must be a flat JSON object"));
  if (request.path == "/api/logout") {
    sessions_.end(cookie(request, "hueline_session"));
    Answer out = json_answer(ordered_json::object());
    out.headers["Set-Cookie"] = cookie_header(request, "", 0);
    return answered(out);
  }
  if (session.role != Role::Operator) return answered(refuse(403, "a viewer may look only: log in as an operator"));
  const auto answer_status = [&](const Status& done, const ordered_json& json) {
    answered(done.ok() ? json_answer(json, 202) : refuse(status_of(done.error()), done.error().message));
  };
  const auto answer_drive = [&](const Result<std::string>& drive) {
    answered(drive.ok() ? json_answer({{"drive", *drive}}, 202)
                        : refuse(status_of(drive.error()), drive.error().message));
  };
  if (request.path == "/api/check")
    return answer_status(drive_.check(text_in(*body, "rig"), number_in(*body, "seconds", 6)), {{"state", "checking"}});
  if (request.path == "/api/start")
    return answer_drive(drive_.drive(text_in(*body, "rig"), text_in(*body, "name"), text_in(*body, "simulate"),
                                     text_in(*body, "override"),
                                     static_cast<std::size_t>(std::clamp(number_in(*body, "checked", 0), 0.0, 1e3))));
  if (request.path == "/api/replay")
    return answer_drive(
        drive_.replay(text_in(*body, "drive"), number_in(*body, "speed", 1), number_in(*body, "from_s", 0)));
  if (request.path == "/api/acknowledge") {
    drive_.acknowledge(text_in(*body, "alarm"));
    return answered(json_answer(ordered_json::object()));
  }
  if (request.path == "/api/sound") {
    if (!try_sound) return answered(refuse(409, "this console has been started without sound: --sound none"));
    try_sound();
    return answered(json_answer(ordered_json::object(), 202));
  }
  if (request.path == "/api/replay/seek")
    return answer_status(drive_.seek(number_in(*body, "position_s", -1)), ordered_json::object());
  const auto answer_command = [&](unsigned status, const auto& send) {
    const auto done = [answered, status](const std::string& error) {
      answered(error.empty() ? json_answer(ordered_json::object(), status) : refuse(409, error));
    };
    if (const Status sent = send(done); !sent.ok()) answered(refuse(status_of(sent.error()), sent.error().message));
  };
  if (request.path == "/api/replay/pace") {
    const bool has_paused = body->contains("paused"), has_speed = body->contains("speed");
    if ((has_paused && !(*body)["paused"].is_boolean()) || (has_speed && !(*body)["speed"].is_number()) ||
        !(has_paused || has_speed))
      return answered(refuse(400, "give paused (true or false), speed (a number), or both"));
    return answer_command(200, [&](const auto& done) {
      return drive_.pace(has_paused ? std::optional((*body)["paused"].get<bool>()) : std::nullopt,
                         has_speed ? std::optional((*body)["speed"].get<double>()) : std::nullopt, done);
    });
  }
  if (request.path == "/api/stop") return answer_command(202, [&](const auto& done) { return drive_.stop(done); });
  if (request.path == "/api/mark")
    return answer_command(200, [&](const auto& done) { return drive_.mark(text_in(*body, "note"), done); });
  answered(refuse(404, "there is no such call"));
}

std::optional<Client> Api::client_of_socket(const Request& request, Answer& refusal) {
  if (const auto token = token_of(request)) {
    if (limit_.wait_s(request.address, Sessions::Clock::now()) > 0) {
      refusal = refuse(429, "too many wrong tokens: wait a minute");
      return {};
    }
    if (const User* user = users().of_token(*token)) return Client{user->name, user->role};
    limit_.note_failure(request.address, Sessions::Clock::now());
    refusal = refuse(401, "the token is wrong: make one with `hueline-console user token NAME`");
    return {};
  }
  if (!is_own_origin(request)) {
    refusal = refuse(403, "the request comes from another page; other programs use ?token=");
    return {};
  }
  if (const Session* session = session_of(request)) return Client{session->name, session->role};
  refusal = users().are_none() ? refuse(503, kNoUsers) : refuse(401, "log in first, or use ?token=");
  return {};
}

bool Api::may_keep_socket(const Request& opened) {
  if (const auto token = token_of(opened)) return users().of_token(*token) != nullptr;
  return session_of(opened) != nullptr;
}

Answer Api::page_file(const Request& request) const {
  if (request.method != "GET" && request.method != "HEAD") return refuse(405, "the page is read with GET");
  static constexpr std::array<std::pair<std::string_view, const char*>, 12> kTypes{{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".webp", "image/webp"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".wasm", "application/wasm"},
      {".webmanifest", "application/manifest+json"},
  }};
  const std::string path = request.path == "/" ? "/index.html" : request.path;
  // Plain names only, so that no path leads out of the folder.
  fs::path file = page_;
  for (std::size_t at = 1; at <= path.size();) {
    const std::size_t end = std::min(path.find('/', at), path.size());
    const std::string part = path.substr(at, end - at);
    if (!is_plain_name(part)) return refuse(404, "there is no such file");
    file /= part;
    at = end + 1;
  }
  const auto type = std::ranges::find(kTypes, file.extension().string(), [](const auto& one) { return one.first; });
  std::error_code ignored;
  if (type == kTypes.end() || !fs::is_regular_file(file, ignored)) {
    if (path == "/index.html")
      return refuse(404, fmt::format("the page is not in {}: build the target hueline_console_page, or give --page",
                                     page_.string()));
    return refuse(404, "there is no such file");
  }
  Answer out = file_answer(file, type->second);
  // Names below /assets/ contain a hash of their content.
  out.headers["Cache-Control"] = path.starts_with("/assets/") ? "public, max-age=31536000, immutable" : "no-cache";
  return out;
}

}  // namespace hueline::console
