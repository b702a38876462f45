#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

// CLI11 costs more compile time than a whole command: it is included by command_line.cpp alone.
namespace CLI {
class App;
}

namespace hueline::apps {

/// What a number on the command line may be; both ends are allowed.
struct Allowed {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
};

/// The words of one command of `hueline` and their help. A word like "--out" is an option, one like "RIG" a position.
/// The values must live until the command has run. Wrong words end the program with exit status 2 and a sentence that
/// names the word.
class Command {
 public:
  Command(CLI::App& app, std::function<int()>& chosen) : app_(&app), chosen_(&chosen) {}

  /// A command of its own below this one.
  Command command(const std::string& name, const std::string& help);
  /// One of the commands below this one has to be given.
  Command& needs_command();

  /// Has to be given.
  Command& required(const std::string& word, std::string& value, const std::string& help);
  Command& required(const std::string& word, std::vector<std::string>& values, const std::string& help);
  /// May be given; `value` says what it is when it is not, which the help does not print.
  Command& option(const std::string& word, std::string& value, const std::string& help);
  Command& option(const std::string& word, std::vector<std::string>& values, const std::string& help);
  Command& option(const std::string& word, double& value, const std::string& help, Allowed allowed = {});
  /// May be given; the help prints what it is when it is not.
  Command& setting(const std::string& word, std::string& value, const std::string& help,
                   const std::vector<std::string>& choices = {});
  Command& setting(const std::string& word, double& value, const std::string& help, Allowed allowed = {});
  Command& setting(const std::string& word, int& value, const std::string& help, Allowed allowed = {});
  Command& flag(const std::string& word, bool& value, const std::string& help);
  Command& footer(const std::string& text);

  /// What the value names is a file that this command reads (or a drive's folder, for its drive.mcap): it is held open,
  /// so that nothing of the command writes over it. A value that names none is left to the command to complain about.
  Command& reads(const std::string& value);
  Command& reads(const std::vector<std::string>& values);
  /// What the value names is a file, or a folder of files, that this command writes. If that cannot be, the program
  /// ends with exit status 4 before the work begins and not behind it. An empty value is none.
  Command& writes(const std::string& value);
  Command& writes_into(const std::string& value);

  /// What it does once the words are read; gives the exit status (apps/exit_code.hpp). Behind everything else.
  void runs(std::function<int()> work);

 private:
  struct Files {
    std::vector<const std::string*> inputs, outputs, output_folders;
    std::vector<const std::vector<std::string>*> input_lists;
  };
  static int run(const Files& files, const std::function<int()>& work);

  CLI::App* app_;
  std::function<int()>* chosen_;  // set when this command is the one that was given
  Files files_;
};

/// The whole program: reads the words, runs the chosen command and gives its exit status; 2 when the words are wrong,
/// with the word that was probably meant. What the command throws goes through.
int run_command_line(int argc, char** argv, const std::string& about, const std::string& version,
                     const std::string& footer, const std::function<void(Command&)>& add_commands);

}  // namespace hueline::apps
