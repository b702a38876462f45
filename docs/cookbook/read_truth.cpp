// Reads what the simulator knows of a drive: the number of its exposures, and the surfaces that the laser truly hit.
#include <cstdio>
#include <map>

#include "sim/truth_file.hpp"

int main(int argc, char** argv) {
  using namespace hueline;
  if (argc != 2) return std::fprintf(stderr, "usage: read_truth TRUTH.bin\n"), 2;
  auto truth = sim::TruthReader::open(argv[1]);
  if (!truth.ok()) return std::fprintf(stderr, "%s\n", truth.error().message.c_str()), 3;
  std::printf("%zu exposures\n", truth->header().exposures.size());
  std::map<std::string, std::size_t> returns;
  for (;;) {
    const auto packet = truth->next_packet();
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) break;
      return std::fprintf(stderr, "%s\n", packet.error().message.c_str()), 3;
    }
    for (const sim::TrueReturn& one : *packet) ++returns[truth->header().surfaces.at(one.surface)];
  }
  for (const auto& [surface, number] : returns) std::printf("%s: %zu returns\n", surface.c_str(), number);
}
