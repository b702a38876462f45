#include <cstring>

#include "apps/commands.hpp"
#include "apps/office_program.hpp"
#include "apps/program.hpp"

/// `hueline`: what a vehicle needs. Commands of hueline-office are found beside it.
int main(int argc, char** argv) {
  using namespace hueline::apps;
  for (const CommandName& command : kOfficeCommands)
    if (argc > 1 && std::strcmp(argv[1], command.word) == 0) return run_office_program(argv);
  return run_program(argc, argv, [](Command& all) {
    add_capture(all);
    add_replay(all);
    add_rig(all);
    add_inspect(all);
    add_picture(all);
    add_colour(all);
    // For --help, and for whoever mistypes one.
    for (const CommandName& command : kOfficeCommands) all.command(command.word, command.help);
  });
}
