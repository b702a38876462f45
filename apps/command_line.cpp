#include "apps/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>

#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "core/input_file.hpp"
#include "core/nearest_word.hpp"
#include "core/output_file.hpp"
#include "core/remote_store.hpp"
#include "runtime/recording.hpp"
#include "storage/journal_reader.hpp"

namespace hueline::apps {
namespace {

template <typename Number>
CLI::Option* number(CLI::App& app, const std::string& word, Number& value, const std::string& help, Allowed allowed) {
  CLI::Option* option = app.add_option(word, value, help);
  // CLI11's own check of a range, which is in the help, takes a word that is no number for one beyond the range.
  option->check([allowed](const std::string& text) {
    double given = 0;
    if (!CLI::detail::lexical_cast(text, given) || std::isnan(given)) return text + " is no number";
    if (given < allowed.least || given > allowed.most)
      return fmt::format("{} is not in range {:g} to {:g}", text, allowed.least, allowed.most);
    Number whole{};
    return CLI::detail::lexical_cast(text, whole) ? std::string() : text + " is no whole number";
  });
  if (allowed.least > -std::numeric_limits<double>::infinity() ||
      allowed.most < std::numeric_limits<double>::infinity())
    option->check(CLI::Range(static_cast<Number>(allowed.least), static_cast<Number>(allowed.most)));
  return option;
}

std::vector<std::string> names_of(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> out;
  for (const CLI::App* command : commands) out.push_back(command->get_name());
  return out;
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) out.push_back("--" + name);
  return out;
}

/// Returns a message about the first word that is no command or option; empty if there is none. CLI11 would report a
/// mistyped word as a missing one.
std::string unknown_word(const CLI::App& all, int argc, char** argv) {
  const CLI::App* app = &all;
  std::string path = all.get_name();
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    if (word.size() > 1 && word[0] == '-' &&
        (word[1] == '-' || std::isalpha(static_cast<unsigned char>(word[1])) != 0)) {
      const std::string name = word.substr(0, word.find('='));
      const CLI::Option* option = app->get_option_no_throw(name);
      if (option == nullptr)
        return fmt::format("{}: unknown option {}{}", path, name, did_you_mean(name, options_of(*app)));
      if (name == word && option->get_items_expected_min() > 0) ++i;  // its value
      continue;
    }
    const auto commands = app->get_subcommands(nullptr);
    if (commands.empty()) continue;
    const auto names = names_of(commands);
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end()) return fmt::format("{}: unknown command {}{}", path, word, did_you_mean(word, names));
    app = commands[static_cast<std::size_t>(found - names.begin())];
    path += " " + word;
  }
  return {};
}

/// Returns the words that a choice of an option allows; empty if it is free. CLI11 gives them as text: "{a,b}".
std::vector<std::string> choices_of(const CLI::Option& option) {
  std::vector<std::string> out;
  const std::string type = option.get_type_name();
  const auto begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return out;
  for (std::size_t at = begin + 1; at <= end;) {
    const std::size_t comma = std::min(type.find(',', at), end);
    out.push_back(type.substr(at, comma - at));
    at = comma + 1;
  }
  return out;
}

/// Returns what may stand in the place of the last of the words, for the completion of a shell. Empty: a file, or a
/// value of the user's own.
std::vector<std::string> completions(const CLI::App& all, const std::vector<std::string>& words) {
  const CLI::App* app = &all;
  const CLI::Option* waiting = nullptr;  // the option whose value comes next
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (std::exchange(waiting, nullptr) != nullptr) continue;
    if (word.starts_with('-')) {
      const CLI::Option* option = app->get_option_no_throw(word);
      if (option != nullptr && option->get_items_expected_min() > 0) waiting = option;
      continue;
    }
    for (const CLI::App* below : app->get_subcommands(nullptr))
      if (below->get_name() == word) {
        app = below;
        break;
      }
  }
  if (waiting != nullptr) return choices_of(*waiting);
  const std::string last = words.empty() ? "" : words.back();
  if (!last.starts_with('-')) return names_of(app->get_subcommands(nullptr));
  return options_of(*app);
}

/// Returns the error that CLI11 found, with the command that it is about and where to read more.
std::string complaint(const CLI::App* app, const CLI::Error& error) {
  std::string path = app->get_name();
  for (auto chosen = app->get_subcommands(); !chosen.empty(); chosen = chosen.front()->get_subcommands()) {
    app = chosen.front();
    path += " " + app->get_name();
  }
  const auto commands = app->get_subcommands(nullptr);
  const bool lacks_command = !commands.empty() && error.get_name() == "RequiredError";
  return fmt::format("{}: {}\n{} --help says what may be given\n", path,
                     lacks_command ? fmt::format("give a command: {}", fmt::join(names_of(commands), ", "))
                                   : std::string(error.what()),
                     path);
}

/// Returns whether making the folder `made` makes `folder` too.
bool comes_with(const std::filesystem::path& folder, const std::string& made) {
  std::error_code error;
  const auto whole = [&](const std::filesystem::path& path) {
    return std::filesystem::absolute(path, error).lexically_normal();
  };
  const std::filesystem::path below = whole(made).lexically_relative(whole(folder));
  return !error && !below.empty() && *below.begin() != "..";
}

bool has_content(const std::filesystem::path& path) {
  std::error_code failed;
  return std::filesystem::is_regular_file(path, failed) && std::filesystem::file_size(path, failed) > 0 && !failed;
}

/// Returns an error if the file is a recording, which nothing replaces.
Status check_no_recording(const std::filesystem::path& path) {
  if (!has_content(path) || !storage::JournalReader::open(path).ok()) return {};
  return output_error("write " + path.string(), EEXIST);
}

/// Returns an error if something is in the file that a new recording must not replace: all but a recording whose header
/// has the entry `mark`.
Status check_recording_place(const std::filesystem::path& path, const std::string& mark) {
  if (!has_content(path)) return {};
  const auto there = storage::JournalReader::open(path);
  if (there.ok() && (*there)->header().about.contains(mark)) return {};
  return output_error("write " + path.string(), EEXIST);
}

}  // namespace

Command& Command::reads(const std::string& value) {
  files_.inputs.push_back(&value);
  return *this;
}

Command& Command::reads(const std::vector<std::string>& values) {
  files_.input_lists.push_back(&values);
  return *this;
}

Command& Command::writes(const std::string& value) {
  files_.outputs.push_back(&value);
  return *this;
}

Command& Command::writes_into(const std::string& value) {
  files_.output_folders.push_back(&value);
  return makes(value);
}

void Command::adds_recording(const std::string& value, bool is_in_folder, const char* mark) {
  const auto is_forced = std::make_shared<bool>(false);
  app_->add_flag("--force", *is_forced, "replace a recording that is there, whatever it is");
  files_.recordings.push_back({&value, is_in_folder, mark, is_forced});
}

Command& Command::writes_recording(const std::string& value, const char* mark) {
  adds_recording(value, false, mark);
  return writes(value);
}

Command& Command::writes_recording_into(const std::string& value, const char* mark) {
  adds_recording(value, true, mark);
  return writes_into(value);
}

Command& Command::makes(const std::string& value) {
  files_.made_folders.push_back(&value);
  return *this;
}

int Command::run(const Files& files, const std::function<int()>& work) {
  std::vector<InputFile> inputs;  // open until the work is done
  const auto hold = [&](const std::string& path) {
    constexpr std::size_t kMostHeld = 500;  // a program may have 1024 files open
    // Nothing is written to an address, so what lies at one needs no protection.
    const auto segments =
        is_address(path) ? Result(std::vector<storage::Segment>()) : storage::find_segments(runtime::drive_file(path));
    if (!segments.ok()) return;
    for (const auto& segment : *segments)
      if (auto file = InputFile::open(segment.path); file.ok() && inputs.size() < kMostHeld)
        inputs.push_back(std::move(*file));
  };
  for (const std::string* path : files.inputs) hold(*path);
  for (const auto* list : files.input_lists)
    for (const std::string& path : *list) hold(path);
  const auto refused = [](const std::string& path, Status (*check)(const std::filesystem::path&)) {
    const Status done = path.empty() ? Status() : check(path);
    if (!done.ok()) log_error(done.error().message);
    return !done.ok();
  };
  // A file in a folder that the command itself makes.
  const auto comes_later = [&](const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::path folder = file.parent_path();
    return !folder.empty() && !std::filesystem::exists(folder, error) && !error &&
           std::ranges::any_of(files.made_folders,
                               [&](const std::string* made) { return !made->empty() && comes_with(folder, *made); });
  };
  const auto is_new_recording = [&](const std::string* path) {
    return std::ranges::any_of(files.recordings, [&](const NewRecording& one) { return one.path == path; });
  };
  for (const std::string* path : files.outputs) {
    if (!comes_later(*path) && refused(*path, check_output)) return kOutputRefused;
    if (!is_new_recording(path) && refused(*path, check_no_recording)) return kOutputRefused;
  }
  for (const std::string* path : files.output_folders)
    if (refused(*path, check_output_folder)) return kOutputRefused;
  for (const NewRecording& one : files.recordings) {
    const std::filesystem::path named = *one.path, path = one.is_in_folder ? named / "drive.mcap" : named;
    const Status free = *one.is_forced ? Status() : check_recording_place(path, one.mark);
    if (free.ok()) continue;
    log_error("{}; --force replaces it", free.error().message);
    return kOutputRefused;
  }
  return work();
}

Command Command::command(const std::string& name, const std::string& help) {
  return Command(*app_->add_subcommand(name, help), *chosen_);
}

Command& Command::needs_command() {
  app_->require_subcommand(1);
  return *this;
}

Command& Command::required(const std::string& word, std::string& value, const std::string& help) {
  app_->add_option(word, value, help)->required();
  return *this;
}

Command& Command::required(const std::string& word, std::vector<std::string>& values, const std::string& help) {
  app_->add_option(word, values, help)->required();
  return *this;
}

Command& Command::option(const std::string& word, std::string& value, const std::string& help) {
  app_->add_option(word, value, help);
  return *this;
}

Command& Command::option(const std::string& word, std::vector<std::string>& values, const std::string& help) {
  app_->add_option(word, values, help);
  return *this;
}

Command& Command::option(const std::string& word, double& value, const std::string& help, Allowed allowed) {
  number(*app_, word, value, help, allowed);
  return *this;
}

Command& Command::setting(const std::string& word, std::string& value, const std::string& help,
                          const std::vector<std::string>& choices) {
  CLI::Option* option = app_->add_option(word, value, help)->capture_default_str();
  if (!choices.empty()) option->check(CLI::IsMember(choices));
  return *this;
}

Command& Command::setting(const std::string& word, double& value, const std::string& help, Allowed allowed) {
  number(*app_, word, value, help, allowed)->capture_default_str();
  return *this;
}

Command& Command::setting(const std::string& word, int& value, const std::string& help, Allowed allowed) {
  if (allowed.least < std::numeric_limits<int>::min()) allowed.least = std::numeric_limits<int>::min();
  if (allowed.most > std::numeric_limits<int>::max()) allowed.most = std::numeric_limits<int>::max();
  number(*app_, word, value, help, allowed)->capture_default_str();
  return *this;
}

Command& Command::flag(const std::string& word, bool& value, const std::string& help) {
  app_->add_flag(word, value, help);
  return *this;
}

Command& Command::needs(const std::string& word, const std::string& other) {
  app_->get_option(word)->needs(app_->get_option(other));
  return *this;
}

Command& Command::excludes(const std::string& word, const std::string& other) {
  app_->get_option(word)->excludes(app_->get_option(other));
  return *this;
}

std::vector<std::string> Command::options() const { return options_of(*app_); }

bool Command::is_given(const std::string& option) const { return app_->count(option) > 0; }

Command& Command::footer(const std::string& text) {
  app_->footer(text);
  return *this;
}

void Command::runs(std::function<int()> work) {
  app_->callback([chosen = chosen_, files = files_, work = std::move(work)] {
    *chosen = [files, work] { return run(files, work); };
  });
}

int run_command_line(int argc, char** argv, const std::string& about, const std::string& version,
                     const std::string& footer, const std::function<void(Command&)>& add_commands) {
  CLI::App app{about, std::filesystem::path(argv[0]).filename().string()};
  app.footer(footer);
  app.set_version_flag("--version", version);
  std::function<int()> chosen;
  Command all(app, chosen);
  all.needs_command();
  add_commands(all);
  if (argc > 1 && std::string_view(argv[1]) == kComplete) {
    for (const std::string& word : completions(app, {argv + 2, argv + argc})) fmt::print("{}\n", word);
    return kDone;
  }
  app.failure_message(complaint);
  if (const std::string unknown = unknown_word(app, argc, argv); !unknown.empty()) {
    std::fprintf(stderr, "%s\n%s --help says what may be given\n", unknown.c_str(),
                 unknown.substr(0, unknown.find(':')).c_str());
    return kWrongUse;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kWrongUse;
  }
  return chosen();
}

}  // namespace hueline::apps
