#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"

extern char** environ;

namespace hueline::test {

/// Runs `hueline ARGUMENTS` as a user starts it, in a process of its own. Output and errors go to one file. The
/// destructor kills the process.
class Program {
 public:
  Program(const std::vector<std::string>& arguments, std::filesystem::path output,
          const std::string& program = HUELINE_PROGRAM)
      : output_(std::move(output)) {
    std::vector<std::string> words{program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    if (posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ) != 0)
      ADD_FAILURE() << "cannot start " << program;
    posix_spawn_file_actions_destroy(&actions);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }

  /// Waits for the end and returns the exit status; -1 if a signal ended the program.
  int wait() {
    int status = -1;
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  /// Returns true once the program has ended. wait() then returns its status.
  bool has_ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == pid_;
  }
  std::string said() const { return contents(output_); }

 private:
  std::filesystem::path output_;
  pid_t pid_ = 0;
};

/// A program that ran to its end.
struct Ran {
  int status;
  std::string said;
};
inline Ran run(const std::vector<std::string>& arguments, const std::string& program = HUELINE_PROGRAM) {
  TemporaryFolder dir;
  Program running(arguments, dir / "said.txt", program);
  const int status = running.wait();
  return {status, running.said()};
}

inline nlohmann::json read_json(const std::filesystem::path& path) { return nlohmann::json::parse(contents(path)); }

/// Returns the entry of a sensor in summary.json, or in the output of `inspect --json`.
inline nlohmann::json sensor_entry(const nlohmann::json& summary, const std::string& name) {
  for (const auto& sensor : summary.at("sensors"))
    if (sensor.at("name") == name) return sensor;
  ADD_FAILURE() << "no sensor " << name;
  return {};
}

}  // namespace hueline::test
