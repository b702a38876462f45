// Draws a rig file. If the file is wrong, the message names the line.
#include <cstdio>
#include <fstream>

#include "config/rig.hpp"
#include "config/rig_picture.hpp"
#include "config/section.hpp"

int main(int argc, char** argv) {
  using namespace hueline;
  if (argc != 3) return std::fprintf(stderr, "usage: draw_rig RIG.yaml OUT.svg\n"), 2;
  try {
    const config::Rig rig = config::load_rig(argv[1]);
    for (const config::Sensor& sensor : rig.sensors) std::printf("%s: %s\n", sensor.name.c_str(), sensor.driver());
    std::ofstream out(argv[2]);
    out << config::rig_svg(rig);
    if (!out.flush()) return std::fprintf(stderr, "%s cannot be written\n", argv[2]), 4;
  } catch (const config::ConfigError& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 2;
  }
}
