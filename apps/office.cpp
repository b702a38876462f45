#include "apps/commands.hpp"
#include "apps/object_storage.hpp"
#include "apps/program.hpp"

/// `hueline-office`: the commands that need the simulator or an adjustment. `hueline` starts it with its own command
/// line.
int main(int argc, char** argv) {
  using namespace hueline::apps;
  const ObjectStorage storage;
  return run_program(argc, argv, [](Command& all) {
    add_simulate(all);
    add_verify(all);
    add_score(all);
    add_calibrate(all);
    add_measure(all);
    add_panorama(all);
    add_fleet(all);
    add_keys(all);
    add_inspect_scenario(all);
  });
}
