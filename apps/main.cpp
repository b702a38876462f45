#include <algorithm>
#include <cstring>
#include <string_view>

#include "apps/commands.hpp"
#include "apps/object_storage.hpp"
#include "apps/office_program.hpp"
#include "apps/program.hpp"

namespace {
bool names_scenario(const std::string_view word) { return word.starts_with("--scenario"); }
}  // namespace

/// `hueline`: the commands that a vehicle needs. It starts hueline-office, which lies beside it, for all others.
int main(int argc, char** argv) {
  using namespace hueline::apps;
  // A shell that completes asks for the words of an office command when a word follows it.
  const bool completes = argc > 1 && std::strcmp(argv[1], kComplete) == 0;
  const char* const word = completes ? (argc > 3 ? argv[2] : "") : (argc > 1 ? argv[1] : "");
  for (const CommandName& command : kOfficeCommands)
    if (std::strcmp(word, command.word) == 0) return run_office_program(argv);
  if (std::strcmp(word, kVerify.word) == 0 && std::any_of(argv + 2, argv + argc, names_scenario))
    return run_office_program(argv);
  const ObjectStorage storage;
  return run_program(argc, argv, [](Command& all) {
    add_capture(all);
    add_replay(all);
    add_check(all);
    add_doctor(all);
    add_rig(all);
    add_inspect(all);
    add_verify_recording(all);
    add_extract(all);
    add_cut(all);
    add_recover(all);
    add_merge(all);
    add_export(all);
    add_decode(all);
    add_import(all);
    add_picture(all);
    add_colour(all);
    // These are listed for --help, and so that a mistyped one is recognised.
    for (const CommandName& command : kOfficeCommands) all.command(command.word, command.help);
  });
}
