#pragma once

#include "core/keys.hpp"
#include "drivers/nmea/nmea_epoch.hpp"
#include "drivers/stream/stream_decoder.hpp"

namespace hueline::drivers {

/// Decodes a stream of NMEA 0183 sentences of any talker into the measurements of NmeaEpoch. Sentences that are not
/// used are counted by their address. Sentences whose check sum is wrong or missing are malformed.
class NmeaDecoder final : public StreamDecoder {
 public:
  struct Config {
    void visit(Keys&) {}
    KeyError validate() const { return {}; }
  };
  explicit NmeaDecoder(const Config&);

 private:
  bool take(const Message& message) override;
  void finish() override;
  void forget() override { epoch_.forget(); }

  NmeaEpoch epoch_;
};

}  // namespace hueline::drivers
