#pragma once

#include <cstdint>

#include "core/decoder.hpp"

namespace hueline::drivers {

/// Counts the messages of a decoder whose names are few literals and change seldom. A name is looked up in
/// DecodeCounts::messages only if it is another than that of the message before, because many packets have so few
/// returns that the look-up would be a part of the work. It belongs to one DecodeCounts; a copy begins anew.
/// Thread safety: none.
class MessageCounter {
 public:
  MessageCounter() = default;
  MessageCounter(const MessageCounter&) {}
  MessageCounter& operator=(const MessageCounter&) {
    name_ = nullptr;
    return *this;
  }

  /// Counts a message. Two names are the same if they are the same literal.
  void add(DecodeCounts& counts, const char* name) {
    if (name != name_) {
      name_ = name;
      count_ = &counts.messages[name];
    }
    ++*count_;
  }

 private:
  const char* name_ = nullptr;
  std::uint64_t* count_ = nullptr;
};

}  // namespace hueline::drivers
