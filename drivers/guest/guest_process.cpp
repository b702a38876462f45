#include "drivers/guest/guest_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/capability.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/guest/protocol.hpp"

namespace hueline::drivers::guest {
namespace {

constexpr std::size_t kKeptWords = 400;

/// While an object of this class lives, programs that this thread starts inherit the rights that a guest may use, as
/// far as the thread has them. Rights from the file (`setcap`) would otherwise end at exec.
class PassedRights {
 public:
  PassedRights() {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    std::array<__user_cap_data_struct, 2> data{};
    if (::syscall(SYS_capget, &header, data.data()) != 0) return;
    for (const unsigned right : {CAP_NET_RAW, CAP_SYS_NICE})
      if (data[0].permitted & 1u << right) data[0].inheritable |= 1u << right;
    if (::syscall(SYS_capset, &header, data.data()) != 0) return;
    // A right that the thread does not have is refused. That is no error.
    for (const unsigned long right : {CAP_NET_RAW, CAP_SYS_NICE})
      ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, right, 0, 0);
  }
  PassedRights(const PassedRights&) = delete;
  ~PassedRights() { ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0); }
};

/// The two option objects of posix_spawn.
struct SpawnOptions {
  SpawnOptions() {
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawnattr_init(&attributes);
  }
  SpawnOptions(const SpawnOptions&) = delete;
  ~SpawnOptions() {
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
  }
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
};

std::vector<std::string> guest_environment() {
  std::vector<std::string> out;
  for (char** variable = environ; variable && *variable; ++variable)
    if (const std::string_view text = *variable; !text.starts_with("LC_") && !text.starts_with("LANG"))
      out.emplace_back(text);
  out.emplace_back("LC_ALL=C");  // the library's messages in English
  return out;
}

}  // namespace

std::filesystem::path guest_program() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return (error ? std::filesystem::path("/usr/bin") : self.parent_path()) / "hueline-guest";
}

Result<GuestProcess> GuestProcess::start(const std::filesystem::path& program) {
  std::array<int, 2> sockets{}, pipe{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets.data()) != 0)
    return io_error("make a guest's socket", errno);
  FileDescriptor ours(sockets[0]), theirs(sockets[1]);
  if (::pipe2(pipe.data(), O_CLOEXEC | O_NONBLOCK) != 0) return io_error("make a guest's pipe", errno);
  FileDescriptor said(pipe[0]), says(pipe[1]);
  // Move the descriptors above those that the guest gets. If this program was started with 0, 1 or 2 closed, they may
  // be among these.
  theirs = FileDescriptor(::fcntl(theirs.get(), F_DUPFD_CLOEXEC, kGuestSocket + 1));
  says = FileDescriptor(::fcntl(says.get(), F_DUPFD_CLOEXEC, kGuestSocket + 1));
  if (!theirs || !says) return io_error("place a guest's descriptors", errno);

  SpawnOptions options;
  ::posix_spawn_file_actions_addopen(&options.actions, 0, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&options.actions, 1, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_adddup2(&options.actions, says.get(), 2);
  ::posix_spawn_file_actions_adddup2(&options.actions, theirs.get(), kGuestSocket);
  ::posix_spawn_file_actions_addclosefrom_np(&options.actions, kGuestSocket + 1);
  // Ctrl-C and the like are blocked in the guest: the program gets them and stops its guests in order. A guest that
  // outlives the program ends when its socket closes.
  sigset_t blocked, usual;
  ::sigemptyset(&blocked);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) ::sigaddset(&blocked, signal);
  ::sigemptyset(&usual);
  for (const int signal : {SIGPIPE, SIGXFSZ}) ::sigaddset(&usual, signal);
  ::posix_spawnattr_setsigmask(&options.attributes, &blocked);
  ::posix_spawnattr_setsigdefault(&options.attributes, &usual);
  ::posix_spawnattr_setpgroup(&options.attributes, 0);
  ::posix_spawnattr_setflags(&options.attributes,
                             POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);

  std::string path = program.string();
  std::array<char*, 2> arguments{path.data(), nullptr};
  std::vector<std::string> environment = guest_environment();
  std::vector<char*> variables;
  for (auto& variable : environment) variables.push_back(variable.data());
  variables.push_back(nullptr);
  pid_t pid = 0;
  const int refused = [&] {
    const PassedRights rights;
    return ::posix_spawn(&pid, path.c_str(), &options.actions, &options.attributes, arguments.data(), variables.data());
  }();
  if (refused != 0)
    return Error{ErrorCode::Unavailable,
                 fmt::format("{}: {}; it belongs beside the program", path, std::strerror(refused))};
  return GuestProcess(pid, std::move(ours), std::move(said));
}

GuestProcess::~GuestProcess() {
  if (pid_ == 0) return;
  kill();
  wait(std::chrono::seconds(1));
}

void GuestProcess::kill() {
  if (pid_ != 0) ::kill(pid_, SIGKILL);
}

bool GuestProcess::wait(std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  for (auto pause = std::chrono::microseconds(200); pid_ != 0;
       pause = std::min(2 * pause, std::chrono::microseconds(10'000))) {
    const pid_t ended = ::waitpid(pid_, &status_, WNOHANG);
    if (ended == pid_ || (ended < 0 && errno != EINTR)) {
      pid_ = 0;
      listen();
    } else if (std::chrono::steady_clock::now() >= end) {
      return false;
    } else {
      std::this_thread::sleep_for(pause);
    }
  }
  return true;
}

void GuestProcess::listen() {
  std::array<char, 4096> piece;
  for (ssize_t n = 0; (n = ::read(said_.get(), piece.data(), piece.size())) > 0;) {
    words_.append(piece.data(), static_cast<std::size_t>(n));
    if (words_.size() > kKeptWords) words_.erase(0, words_.size() - kKeptWords);
  }
}

bool GuestProcess::has_ended_well() const { return pid_ == 0 && WIFEXITED(status_) && WEXITSTATUS(status_) == 0; }

std::string GuestProcess::end() const {
  std::string text = WIFSIGNALED(status_) ? fmt::format("it was ended by signal {} ({})", WTERMSIG(status_),
                                                        ::strsignal(WTERMSIG(status_)))
                     : WIFEXITED(status_) ? fmt::format("it ended with status {}", WEXITSTATUS(status_))
                                          : "it ended";
  if (!words_.empty()) text += fmt::format("; it said: {}", printable(words_, kKeptWords));
  return text;
}

}  // namespace hueline::drivers::guest
