#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hueline {

/// A program that this one has started. Thread safety: none; one thread calls all functions.
class Child {
 public:
  /// Whose signals a program gets. In a session of its own it goes on when the program that started it ends, and when
  /// its terminal does. In that of its parent a Ctrl-C, and a scheduler that ends a job, reach both.
  enum class Session { Own, Parents };

  Child() = default;
  /// Starts `words` (the first is the program's path) without a shell. Its input is empty; what it prints goes into the
  /// file `said`, or in two files if `printed` is given: standard output there. It gets no other file or socket of this
  /// program. Error: Io.
  static Result<Child> start(const std::vector<std::string>& words, const std::filesystem::path& said,
                             const std::filesystem::path& printed = {}, Session session = Session::Own);
  bool is_running() const { return pid_ > 0; }
  pid_t pid() const { return pid_; }
  /// Returns the exit status once the program has ended, 128 + its number if a signal ended it; nothing before, and
  /// nothing again afterwards.
  std::optional<int> take_end();
  /// Asks it to end (SIGTERM).
  void ask_to_end() const;

 private:
  pid_t pid_ = -1;
};

/// Lets the other programs of this computer have the processors first, and the memory: for a program that works beside
/// a capture.
void give_way();

/// Returns the path of the program of that name in the folder of the running one, where an installation has both.
std::filesystem::path program_beside_this(const std::string& name);

/// Returns the last lines of a file, at most `bytes` bytes of valid UTF-8.
std::string last_lines(const std::filesystem::path& file, std::size_t bytes);

}  // namespace hueline
