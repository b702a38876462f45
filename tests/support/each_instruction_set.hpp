#pragma once

#include <hwy/targets.h>

#include <gtest/gtest.h>

namespace hueline::test {

/// Calls `check` with each set of vector instructions that the program has and the processor supports, because the
/// others would only be tried on other computers.
template <class Check>
void with_each_instruction_set(const Check& check) {
  for (const auto target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    check();
  }
  hwy::SetSupportedTargetsForTest(0);  // all again
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace hueline::test
