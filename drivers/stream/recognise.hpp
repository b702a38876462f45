#pragma once

#include <span>
#include <string_view>

#include "drivers/stream/message_form.hpp"

namespace hueline::drivers {

/// Returns whether a whole message of `Form` is among the first bytes of a file. Other messages, text and broken bytes
/// may stand before it.
template <class Form>
bool has_message(std::string_view first_bytes) {
  Form form;
  const auto all = std::as_bytes(std::span(first_bytes));
  for (std::size_t at = 0; at < all.size(); ++at)
    if (form.judge(all.subspan(at), at, at == 0).verdict == Judgement::Verdict::Whole) return true;
  return false;
}

}  // namespace hueline::drivers
