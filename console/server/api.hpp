#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "console/server/drive_control.hpp"
#include "console/server/map_tiles.hpp"
#include "console/server/sessions.hpp"
#include "console/server/users.hpp"

namespace hueline::console {

/// A request, as the server has read it.
struct Request {
  std::string method;  ///< "GET", "POST", ...
  std::string path;    ///< without the part behind '?'
  std::string query;
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
  std::string address;  ///< of the client
  bool is_secure = false;
};

/// An answer.
struct Answer {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body;
  std::map<std::string, std::string> headers;
};

/// Who is behind a request.
struct Client {
  std::string name;
  Role role = Role::Viewer;
};

/// Answers the requests of the console: the page's files and the REST calls (docs/operating.md).
/// Thread safety: none; one thread.
class Api {
 public:
  using Answered = std::function<void(Answer)>;
  /// `page` is the folder of the page's files, `users` the file of the users, `tiles` what the map is drawn on, if
  /// there is anything.
  Api(DriveControl& drive, std::filesystem::path page, std::filesystem::path users, std::optional<MapTiles> tiles);

  /// Answers through `answered`, at once or later.
  void answer(const Request& request, const Answered& answered);
  /// Returns who may open a WebSocket with this request, or the answer that refuses it.
  std::optional<Client> client_of_socket(const Request& request, Answer& refusal);
  /// Returns whether who opened a WebSocket with this request may keep it: the token's user or the session is still
  /// there. The session counts as used, so it does not end while somebody looks at the page.
  bool may_keep_socket(const Request& opened);
  /// Returns whether the page's origin is this server, or the request has none.
  static bool is_own_origin(const Request& request);
  /// Lets this computer sound an alarm once, for somebody who listens. Empty: this console has no sound.
  std::function<void()> try_sound;

 private:
  Answer page_file(const Request& request) const;
  Answer tile(std::string_view place) const;
  Answer log_in(const Request& request);
  Answer get(const Request& request, const Session& session);
  void post(const Request& request, const Session& session, const Answered& answered);
  const Session* session_of(const Request& request);
  /// Reads the users again if their file has changed.
  const Users& users();

  DriveControl& drive_;
  const std::filesystem::path page_, users_file_;
  const std::optional<MapTiles> tiles_;
  Users users_;
  std::filesystem::file_time_type users_read_{};
  Sessions sessions_;
  LoginLimit limit_;
};

/// Returns an answer with {"error": text}.
Answer refuse(unsigned status, const std::string& text);

}  // namespace hueline::console
