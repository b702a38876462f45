#include "apps/command_line.hpp"

#include <CLI/CLI.hpp>

#include "apps/exit_code.hpp"

namespace hueline::apps {
namespace {

template <typename Number>
CLI::Option* number(CLI::App& app, const std::string& word, Number& value, const std::string& help, Allowed allowed) {
  CLI::Option* option = app.add_option(word, value, help);
  if (allowed.least > -std::numeric_limits<double>::infinity() || allowed.most < std::numeric_limits<double>::infinity())
    option->check(CLI::Range(static_cast<Number>(allowed.least), static_cast<Number>(allowed.most)));
  return option;
}

}  // namespace

Command Command::command(const std::string& name, const std::string& help) { return Command(*app_->add_subcommand(name, help), *chosen_); }

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

Command& Command::setting(const std::string& word, std::string& value, const std::string& help, const std::vector<std::string>& choices) {
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

Command& Command::footer(const std::string& text) {
  app_->footer(text);
  return *this;
}

void Command::runs(std::function<int()> work) {
  app_->callback([chosen = chosen_, work = std::move(work)] { *chosen = work; });
}

int run_command_line(int argc, char** argv, const std::string& about, const std::string& version, const std::string& footer,
                     const std::function<void(Command&)>& add_commands) {
  CLI::App app{about};
  app.footer(footer);
  app.set_version_flag("--version", version);
  std::function<int()> chosen;
  Command all(app, chosen);
  all.needs_command();
  add_commands(all);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kWrongUse;
  }
  return chosen();
}

}  // namespace hueline::apps
