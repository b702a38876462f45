#pragma once

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <string>

/// What every benchmark needs to say that it did what it measures. Programs link `hueline_bench_main`, which ends with
/// a status other than 0 where one did not.
namespace hueline::test {

/// Each benchmark's work is to be shown, not measured: little of it is enough, and the figures mean nothing. So the
/// test run wants it.
inline bool is_brief() { return std::getenv("HUELINE_BENCH_BRIEF") != nullptr; }
template <class T>
T sized(T full, T brief) {
  return is_brief() ? brief : full;
}

/// Fails the benchmark unless its work was done. `what`: the work, as a clause.
inline void expect(benchmark::State& state, bool is_done, const char* what) {
  if (!is_done) state.SkipWithError((std::string("not so: ") + what).c_str());
}

/// A benchmark that needs a recording which is not here: skipped, as tests are.
constexpr const char* kNoRecording = "recording not present";

}  // namespace hueline::test
