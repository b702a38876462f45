// Runs a recorded drive through decoders, clocks and colouring, and prints every thousandth point.
#include <cstdio>

#include "runtime/pipeline.hpp"
#include "runtime/recording.hpp"

using namespace hueline;

// A sink receives the products of the pipeline. It overrides the functions of the products that it uses.
class CsvSink final : public runtime::ProductSink {
 public:
  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override {
    for (const ColouredPoint& point : block.points)
      if (points_++ % 1000 == 0)
        std::printf("%.3f,%.3f,%.3f,%d,%d,%d\n", static_cast<double>(point.east), static_cast<double>(point.north),
                    static_cast<double>(point.up), point.red, point.green, point.blue);
  }
  std::size_t points() const { return points_; }

 private:
  std::size_t points_ = 0;
};

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: replay_to_csv DRIVE\n"), 2;
  auto recording = runtime::Recording::open(argv[1]);
  if (!recording.ok()) return std::fprintf(stderr, "%s\n", recording.error().message.c_str()), 3;
  CsvSink sink;
  runtime::Pipeline pipeline(recording->rig, 2, sink);
  std::puts("east_m,north_m,up_m,red,green,blue");
  const Status read = recording->for_each([&](const Packet& packet) {
    pipeline.process(packet);
    return true;
  });
  pipeline.flush();
  std::fprintf(stderr, "%zu points\n", sink.points());
  if (!read.ok()) return std::fprintf(stderr, "%s\n", read.error().message.c_str()), 3;
}
