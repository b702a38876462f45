#include "core/child.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "core/printable.hpp"

namespace hueline {

Result<Child> Child::start(const std::vector<std::string>& words, const std::filesystem::path& said,
                           const std::filesystem::path& printed, Session session) {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  // posix_spawn() does not tell a file that cannot be written from a program that cannot be started.
  for (const std::filesystem::path& file : {said, printed}) {
    if (file.empty()) continue;
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
    if (fd < 0) return io_error(file.string() + " cannot be written", errno);
    ::close(fd);
  }
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  constexpr int kWrite = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, said.c_str(), kWrite, 0644);
  if (printed.empty())
    posix_spawn_file_actions_adddup2(&files, STDERR_FILENO, STDOUT_FILENO);
  else
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, printed.c_str(), kWrite, 0644);
  // A program that kept this one's sockets would keep its port, and its clients' connections, open when this one ends.
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // Who starts it may block and ignore signals that the program must get.
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  const int own = session == Session::Own ? POSIX_SPAWN_SETSID : 0;
  posix_spawnattr_setflags(&attributes, static_cast<short>(own | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF));
  Child child;
  const int failed = ::posix_spawn(&child.pid_, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (failed != 0) return io_error(words.front() + " cannot be started", failed);
  return child;
}

std::optional<int> Child::take_end() {
  if (pid_ <= 0) return {};
  int status = 0;
  const pid_t got = ::waitpid(pid_, &status, WNOHANG);
  if (got == 0) return {};
  pid_ = -1;
  if (got < 0) return 0;  // somebody else has waited for it
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void Child::ask_to_end() const {
  if (pid_ > 0) ::kill(pid_, SIGTERM);
}

void give_way() {
  constexpr int kNiceness = 10;
  (void)::setpriority(PRIO_PROCESS, 0, kNiceness);
  // The kernel may share the processors among sessions first, where the priority of a process counts for nothing.
  if (std::ofstream session("/proc/self/autogroup"); session) session << kNiceness;
  // It ends before the capture, whose protection it has inherited, when memory runs out.
  if (std::ofstream memory("/proc/self/oom_score_adj"); memory) memory << 500;
}

std::filesystem::path program_beside_this(const std::string& name) {
  std::error_code unread;
  return std::filesystem::read_symlink("/proc/self/exe", unread).parent_path() / name;
}

std::string last_lines(const std::filesystem::path& file, std::size_t bytes) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) return {};
  const auto size = static_cast<std::size_t>(std::max<std::streamoff>(0, in.tellg()));
  in.seekg(static_cast<std::streamoff>(size - std::min(size, bytes)));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (size > bytes) text.erase(0, std::min(text.size(), text.find('\n') + 1));
  return printable(text, LineEnds::Keep);
}

}  // namespace hueline
