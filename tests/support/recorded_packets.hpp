#pragma once

#include <gtest/gtest.h>

#include <filesystem>

#include "storage/journal_reader.hpp"

namespace hueline::test {

/// Calls `use(packet, header)` with each packet of a recording, in its order. A recording that cannot be opened or does
/// not end well fails the test.
template <class Use>
void for_each_recorded_packet(const std::filesystem::path& file, const Use& use) {
  auto journal = storage::JournalReader::open(file);
  if (!journal.ok()) {
    ADD_FAILURE() << journal.error().message;
    return;
  }
  for (;;) {
    const auto packet = (*journal)->next({});
    if (!packet.ok()) {
      EXPECT_EQ(packet.error().code, ErrorCode::EndOfData) << packet.error().message;
      return;
    }
    use(*packet, (*journal)->header());
  }
}

}  // namespace hueline::test
