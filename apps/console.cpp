#include <fmt/format.h>
#include <sodium.h>
#include <termios.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "apps/command_line.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "console/server/alarm_sound.hpp"
#include "console/server/api.hpp"
#include "console/server/certificate.hpp"
#include "console/server/drive_control.hpp"
#include "console/server/map_tiles.hpp"
#include "console/server/server.hpp"
#include "console/server/users.hpp"
#include "core/printable.hpp"
#include "core/standard_streams.hpp"
#include "runtime/version.hpp"

/// hueline-console: the server of the operator's console, and its users.
namespace hueline::apps {
namespace {

namespace fs = std::filesystem;

struct ConsoleOptions {
  std::string drives, page, rigs, scenarios, hueline, users, tiles, address = "127.0.0.1", certificate, key,
                                                                    sound = "default";
  int port = 8765;
  double hours = 4;
  bool is_plain = false;
  std::string name, role = "viewer";
};

/// Returns the folder for what the console keeps: users, key and certificate.
fs::path settings() {
  if (const char* folder = std::getenv("XDG_CONFIG_HOME"); folder != nullptr && *folder)
    return fs::path(folder) / "hueline";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home) return fs::path(home) / ".config" / "hueline";
  return "/etc/hueline";
}

fs::path own_folder() {
  std::error_code failed;
  return fs::read_symlink("/proc/self/exe", failed).parent_path();
}

fs::path users_file(const ConsoleOptions& options) {
  return options.users.empty() ? settings() / "console-users.json" : fs::path(options.users);
}

bool is_local(const std::string& address) { return address == "127.0.0.1" || address == "::1"; }

int serve(const ConsoleOptions& options) {
  if (options.is_plain && !is_local(options.address)) {
    log_error("--plain sends passwords in clear, so it is for this computer only: leave out --plain or --address");
    return kWrongUse;
  }
  std::signal(SIGPIPE, SIG_IGN);
  std::error_code failed;
  fs::create_directories(options.drives, failed);
  if (failed) {
    log_error(fmt::format("{}: {}", options.drives, failed.message()));
    return kOutputRefused;
  }
  fs::create_directories(settings(), failed);  // an error shows when a file is written there
  if (::access(options.drives.c_str(), W_OK) != 0)
    log_warning("{}: {}; its drives can be looked at, and none can be checked, started or replayed", options.drives,
                std::strerror(errno));
  for (const auto& [option, folder] : {std::pair("--rigs", &options.rigs), {"--allow-simulate", &options.scenarios}})
    if (!folder->empty() && !fs::is_directory(*folder, failed)) {
      log_error("{} {}: there is no such folder", option, *folder);
      return kWrongUse;
    }
  const auto users = console::Users::load(users_file(options));
  if (!users.ok()) {
    log_error(users.error().message);
    return kWrongUse;
  }
  if (users->are_none())
    log_warning("nobody can log in: make a user with `hueline-console user add NAME --role operator{}`",
                options.users.empty() ? "" : " --users " + options.users);

  std::optional<console::MapTiles> tiles;
  if (!options.tiles.empty()) {
    auto found = console::MapTiles::open(options.tiles);
    if (!found.ok()) {
      log_error("--tiles: {}", found.error().message);
      return kWrongUse;
    }
    tiles.emplace(std::move(*found));
  }

  std::optional<boost::asio::ssl::context> tls;
  if (!options.is_plain) {
    const fs::path certificate =
        options.certificate.empty() ? settings() / "console-certificate.pem" : fs::path(options.certificate);
    const fs::path key = options.key.empty() ? settings() / "console-key.pem" : fs::path(options.key);
    if (options.certificate.empty())
      if (Status made = console::make_certificate(certificate, key); !made.ok()) {
        log_error(made.error().message);
        return kOutputRefused;
      }
    auto context = console::tls_context(certificate, key);
    if (!context.ok()) {
      log_error(context.error().message);
      return kWrongUse;
    }
    tls.emplace(std::move(*context));
    if (const auto print = console::fingerprint(certificate); print.ok())
      log_info("the certificate's SHA-256 is {}", *print);
  }

  boost::asio::io_context io(1);
  console::Places places;
  places.drives = fs::absolute(options.drives);
  places.hueline = options.hueline.empty() ? own_folder() / "hueline" : fs::path(options.hueline);
  places.rigs = options.rigs;
  places.scenarios = options.scenarios;
  places.check_hours = options.hours;
  console::DriveControl drive(io, places);
  const fs::path page =
      options.page.empty() ? own_folder().parent_path() / "share" / "hueline" / "console" : fs::path(options.page);
  console::Api api(drive, page, users_file(options), std::move(tiles));
  std::optional<console::AlarmSound> sound;
  if (options.sound != "none") {
    sound.emplace(options.sound, [&](const std::string& trouble) {
      if (trouble.empty())
        log_info("alarms can be heard again");
      else
        log_warning("{}", trouble);
      boost::asio::post(io, [&drive, trouble] { drive.set_sound_trouble(trouble); });
    });
    drive.alarms().on_change = [&](bool is_alarm, std::uint64_t warnings) { sound->set(is_alarm, warnings); };
    api.try_sound = [&] { sound->try_out(); };
  }
  console::Server::Config config;
  config.address = options.address;
  config.port = static_cast<std::uint16_t>(options.port);
  config.tls = tls ? &*tls : nullptr;
  console::Server server(io, api, drive, config);
  if (Status started = server.start(); !started.ok()) {
    log_error(started.error().message);
    return kOutputRefused;
  }
  drive.start();
  log_info("the console is at {}://{}:{}/; Ctrl-C ends it, and not the drive", tls ? "https" : "http",
           options.address.find(':') == std::string::npos ? options.address : "[" + options.address + "]",
           server.port());
  boost::asio::signal_set signals(io, SIGINT, SIGTERM, SIGHUP);
  signals.async_wait([&](boost::system::error_code, int) { io.stop(); });
  io.run();
  // Connections end with the process. Their destructors would need the objects above in another order.
  (void)flush_standard_output();
  std::_Exit(kDone);
}

/// Reads a password from the terminal without showing it, or a line of standard input.
std::string read_password(const char* question) {
  const bool is_terminal = isatty(STDIN_FILENO) != 0;
  termios shown{};
  if (is_terminal) {
    std::fputs(question, stderr);
    tcgetattr(STDIN_FILENO, &shown);
    termios hidden = shown;
    hidden.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &hidden);
  }
  std::string line;
  std::getline(std::cin, line);
  if (is_terminal) {
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &shown);
    std::fputc('\n', stderr);
  }
  return line;
}

int change_users(const ConsoleOptions& options, const std::function<Status(console::Users&)>& change) {
  const fs::path file = users_file(options);
  std::error_code ignored;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), ignored);
  auto users = console::Users::load(file);
  Status done = users.ok() ? change(*users) : Status(users.error());
  if (done.ok()) done = users->save(file);
  if (done.ok()) return kDone;
  log_error(done.error().message);
  return done.error().code == ErrorCode::Io ? kOutputRefused : kWrongUse;
}

int add_user(const ConsoleOptions& options) {
  const std::string password = read_password("password: ");
  if (isatty(STDIN_FILENO) != 0 && read_password("again: ") != password) {
    log_error("the two passwords differ");
    return kWrongUse;
  }
  const int status = change_users(options, [&](console::Users& users) {
    return users.add(options.name, *console::role_of(options.role), password);
  });
  if (status == kDone) fmt::print("{} may log in as {}\n", options.name, options.role);
  return status;
}

int remove_user(const ConsoleOptions& options) {
  const int status = change_users(options, [&](console::Users& users) { return users.remove(options.name); });
  if (status == kDone) fmt::print("{} may no longer log in\n", options.name);
  return status;
}

int list_users(const ConsoleOptions& options) {
  const auto users = console::Users::load(users_file(options));
  if (!users.ok()) {
    log_error(users.error().message);
    return kWrongUse;
  }
  for (const console::User& user : users->all())
    fmt::print("{:20} {:10}{}\n", user.name, console::name(user.role), user.token_hash.empty() ? "" : "has a token");
  return kDone;
}

int make_token(const ConsoleOptions& options) {
  std::string made;
  const int status = change_users(options, [&](console::Users& users) -> Status {
    auto token = users.make_token(options.name);
    if (!token.ok()) return token.error();
    made = std::move(*token);
    return {};
  });
  if (status == kDone) fmt::print("{}\n", made);  // one that could not be kept is none
  return status;
}

void add_commands(Command& all) {
  auto options = std::make_shared<ConsoleOptions>();
  Command serve_command = all.command("serve", "serve the operator's page, and Foxglove clients");
  serve_command.required("--drives", options->drives, "folder of the drives; a drive gets a folder in it");
  serve_command.option("--rigs", options->rigs, "folder of the rigs (YAML) that can be driven");
  serve_command.setting("--address", options->address, "address to listen at; 0.0.0.0: all of this computer");
  serve_command.setting("--port", options->port, "port; 0: any that is free", {0, 65535});
  serve_command.option("--tiles", options->tiles,
                       "folder of map tiles (Z/X/Y.png) that the map of the drive is drawn on; without it on a grid");
  serve_command.option("--page", options->page, "folder of the page's files, if not the program's own");
  serve_command.option("--users", options->users, "file of the users, if not ~/.config/hueline/console-users.json");
  serve_command.option("--certificate", options->certificate,
                       "certificate (PEM); without it one is made on first use and kept in ~/.config/hueline");
  serve_command.option("--key", options->key, "key of the certificate (PEM)");
  serve_command.flag("--plain", options->is_plain, "HTTP without TLS; for this computer only");
  serve_command.option("--allow-simulate", options->scenarios,
                       "folder of scenarios that the page may drive with emulated devices");
  serve_command.option("--hueline", options->hueline, "the program `hueline`, if not the one beside this program");
  serve_command.setting("--sound", options->sound,
                        "sound device of this computer for alarms, as `aplay -L` names it; none: no sound");
  serve_command.setting("--hours", options->hours, "how long a drive will be, for the check of the disk",
                        {0.0, 1000.0});
  serve_command.footer(
      "A drive does not depend on this program: it goes on when the console ends, and a console that is "
      "started again finds it.");
  serve_command.runs([options] { return serve(*options); });

  Command user = all.command("user", "make users of the console");
  user.needs_command();
  Command add = user.command("add", "add a user, or give one another password, which is read from standard input");
  add.required("NAME", options->name, "name of the user");
  add.setting("--role", options->role, "an operator may start, mark and stop drives; a viewer may look",
              {"operator", "viewer"});
  add.option("--users", options->users, "file of the users, if not ~/.config/hueline/console-users.json");
  add.runs([options] { return add_user(*options); });
  Command token = user.command(
      "token", "make and print a token of a user, for programs that cannot log in: wss://HOST:8765/?token=TOKEN");
  token.required("NAME", options->name, "name of the user");
  token.option("--users", options->users, "file of the users, if not ~/.config/hueline/console-users.json");
  token.runs([options] { return make_token(*options); });
  Command remove = user.command("remove", "remove a user with token and sessions, also while a console runs");
  remove.required("NAME", options->name, "name of the user");
  remove.option("--users", options->users, "file of the users, if not ~/.config/hueline/console-users.json");
  remove.runs([options] { return remove_user(*options); });
  Command list = user.command("list", "list the users and their roles");
  list.option("--users", options->users, "file of the users, if not ~/.config/hueline/console-users.json");
  list.runs([options] { return list_users(*options); });
}

}  // namespace
}  // namespace hueline::apps

int main(int argc, char** argv) {
  using namespace hueline;
  using namespace hueline::apps;
  open_standard_streams();
  set_up_log();
  if (sodium_init() < 0) {
    log_error("libsodium cannot start: is there no source of random numbers?");
    return kFailed;
  }
  try {
    const int status = run_command_line(
        argc, argv, "hueline-console: the operator's page for drives, and a server for Foxglove clients.",
        std::string("hueline-console ") + runtime::kVersion + " (" + runtime::kGitRevision + ")",
        "\nThe first time: hueline-console user add NAME --role operator", add_commands);
    const Status written = flush_standard_output();
    if (written.ok()) return status;
    log_error(written.error().message);
    return status == kDone ? kOutputRefused : status;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "hueline-console: %s\n", printable(e.what(), LineEnds::Keep).c_str());
    return kFailed;
  }
}
