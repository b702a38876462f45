#include "drivers/nmea/nmea_decoder.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/stream/line_form.hpp"

namespace hueline::drivers {
namespace {

std::vector<std::unique_ptr<MessageForm>> nmea_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<NmeaForm>());
  out.push_back(std::make_unique<LineForm>());
  return out;
}

}  // namespace

NmeaDecoder::NmeaDecoder(const Config&) : StreamDecoder(nmea_forms()) {}

bool NmeaDecoder::take(const Message& message) {
  if (message.form != 0) {
    name("text");
    return false;
  }
  const NmeaSentence sentence(message.bytes);
  name(std::string(sentence.talker()) + std::string(sentence.type()));
  std::vector<Measurement> made;
  const bool is_used = epoch_.take(sentence, message.received, made);
  emit_all(std::move(made));
  return is_used;
}

void NmeaDecoder::finish() {
  std::vector<Measurement> made;
  epoch_.finish(made);
  emit_all(std::move(made));
}

}  // namespace hueline::drivers
