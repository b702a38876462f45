#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

// CLI11 costs more compile time than a whole command: it is included by command_line.cpp alone.
namespace CLI {
class App;
}

namespace hueline::apps {

/// The range of a number on the command line; both ends are allowed.
struct Allowed {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
};

/// The words of one command of `hueline` and their help. A word like "--out" is an option, a word like "RIG" a
/// positional argument. The variables that receive the values must exist until the command has run. Wrong words end the
/// program with exit status 2 and a sentence that names the word.
class Command {
 public:
  Command(CLI::App& app, std::function<int()>& chosen) : app_(&app), chosen_(&chosen) {}

  /// Adds a command below this one.
  Command command(const std::string& name, const std::string& help);
  /// Requires that one of the commands below this one is given.
  Command& needs_command();

  /// Adds a word that must be given.
  Command& required(const std::string& word, std::string& value, const std::string& help);
  Command& required(const std::string& word, std::vector<std::string>& values, const std::string& help);
  /// Adds a word that may be given. Without it `value` keeps its value, which the help does not print.
  Command& option(const std::string& word, std::string& value, const std::string& help);
  Command& option(const std::string& word, std::vector<std::string>& values, const std::string& help);
  Command& option(const std::string& word, double& value, const std::string& help, Allowed allowed = {});
  /// Adds a word that may be given. Without it `value` keeps its value, which the help prints.
  Command& setting(const std::string& word, std::string& value, const std::string& help,
                   const std::vector<std::string>& choices = {});
  Command& setting(const std::string& word, double& value, const std::string& help, Allowed allowed = {});
  Command& setting(const std::string& word, int& value, const std::string& help, Allowed allowed = {});
  /// Adds a word without a value. `value` becomes true if it is given.
  Command& flag(const std::string& word, bool& value, const std::string& help);
  /// Sets the text below the help of this command.
  Command& footer(const std::string& text);

  /// Declares that a word is of use only together with another one, or not together with it. Wrong words give 2.
  Command& needs(const std::string& word, const std::string& other);
  Command& excludes(const std::string& word, const std::string& other);
  /// Returns the options that have been added so far, as "--out".
  std::vector<std::string> options() const;
  /// Returns whether an option was given. For the command's work.
  bool is_given(const std::string& option) const;

  /// Declares that the value names a file which this command reads, or a drive's folder, which stands for its
  /// drive.mcap. The file is held open so that the command cannot write over it. A value that names no file is left to
  /// the command to report.
  Command& reads(const std::string& value);
  Command& reads(const std::vector<std::string>& values);
  /// Declares that the value names a file, or a folder of files, that this command writes. If that is impossible, the
  /// program ends with exit status 4 before the work begins, and so it does if the file is a recording. An empty value
  /// names nothing. The folder of a file may be
  /// missing if it is one that the command makes for its folder of files.
  Command& writes(const std::string& value);
  Command& writes_into(const std::string& value);
  /// The same for a recording, and adds the option --force. A recording takes nobody else's place: status 4 too if a
  /// file is there that has anything in it, unless its header has the entry `mark`, by which it is an earlier result of
  /// such a command, or the user says --force.
  Command& writes_recording(const std::string& value, const char* mark);
  Command& writes_recording_into(const std::string& value, const char* mark);
  /// Declares that the value names a folder that this command makes if it is missing, and does not always write into.
  Command& makes(const std::string& value);

  /// Sets the work of the command, which runs after the words are read and returns the exit status
  /// (apps/exit_code.hpp). Call this last.
  void runs(std::function<int()> work);

 private:
  struct NewRecording {
    const std::string* path;
    bool is_in_folder;
    const char* mark;
    std::shared_ptr<bool> is_forced;
  };
  struct Files {
    std::vector<const std::string*> inputs, outputs, output_folders, made_folders;
    std::vector<const std::vector<std::string>*> input_lists;
    std::vector<NewRecording> recordings;
  };
  void adds_recording(const std::string& value, bool is_in_folder, const char* mark);
  static int run(const Files& files, const std::function<int()>& work);

  CLI::App* app_;
  std::function<int()>* chosen_;  // set when this command is the one that was given
  Files files_;
};

/// The word with which a shell asks a program what may stand in the place of the last word that follows it
/// (packaging/completion.bash).
inline constexpr const char* kComplete = "--complete";

/// Runs the whole program: reads the words, runs the chosen command and returns its exit status. Wrong words give 2,
/// with the word that was probably meant. Exceptions of the command pass through. After kComplete it prints what the
/// shell asks for, one word a line.
int run_command_line(int argc, char** argv, const std::string& about, const std::string& version,
                     const std::string& footer, const std::function<void(Command&)>& add_commands);

}  // namespace hueline::apps
