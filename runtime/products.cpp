#include "runtime/products.hpp"

namespace hueline::runtime {

std::string text(const OperatorCommand& command) {
  std::string out = name(command.command.kind);
  if (!command.command.note.empty()) out += ": " + command.command.note;
  return out;
}

}  // namespace hueline::runtime
