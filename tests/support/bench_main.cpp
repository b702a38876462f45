// The main program of every benchmark. Google Benchmark's own main() returns 0 even if benchmarks failed or none ran.
#include <algorithm>
#include <cstdio>

#include "tests/support/bench.hpp"

namespace {

/// Prints as the command line asks, and counts the benchmarks that failed.
class CountingReporter final : public benchmark::BenchmarkReporter {
 public:
  explicit CountingReporter(benchmark::BenchmarkReporter& printer) : printer_(printer) {}
  bool ReportContext(const Context& context) override { return printer_.ReportContext(context); }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const bool is_absent = run.error_occurred && run.error_message == hueline::test::kNoRecording;
      absent += is_absent;
      failed += run.error_occurred && !is_absent;
    }
    printer_.ReportRuns(runs);
  }
  void Finalize() override { printer_.Finalize(); }

  std::size_t failed = 0, absent = 0;

 private:
  benchmark::BenchmarkReporter& printer_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  CountingReporter reporter(*benchmark::CreateDefaultDisplayReporter());
  const std::size_t ran = benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
  if (reporter.failed > 0) std::fprintf(stderr, "%zu benchmarks did not do what they measure\n", reporter.failed);
  if (reporter.failed > 0 || ran == 0) return 1;
  return reporter.absent > 0 ? 77 : 0;
}
