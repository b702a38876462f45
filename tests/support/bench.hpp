#pragma once

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <string>

/// Lets a benchmark show that it did the work that it measures. Programs link `hueline_bench_main`, which exits with a
/// status other than 0 if one did not.
namespace hueline::test {

/// Returns whether this run only has to show that the benchmarks do their work, as in the test run. They then do little
/// of it, and their figures mean nothing.
inline bool is_brief() { return std::getenv("HUELINE_BENCH_BRIEF") != nullptr; }
template <class T>
T sized(T full, T brief) {
  return is_brief() ? brief : full;
}

/// Fails the benchmark unless its work was done. `what` describes the work as a clause.
inline void expect(benchmark::State& state, bool is_done, const char* what) {
  if (!is_done) state.SkipWithError((std::string("not so: ") + what).c_str());
}

/// Message of a benchmark that needs a recording which is not present. It is skipped, as tests are.
constexpr const char* kNoRecording = "recording not present";

}  // namespace hueline::test
