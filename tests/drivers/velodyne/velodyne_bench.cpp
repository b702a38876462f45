// Decoding compared with a copy of the same returns.
#include "tests/drivers/decode_bench.hpp"

namespace {

using namespace hueline;
using namespace hueline::drivers;

test::DecodeWork recorded(const char* file, VelodyneModel model) {
  VelodyneDecoder::Config config;
  config.model = model;
  return {test::decoder_of<VelodyneDecoder>(config),
          test::recorded_packets(std::string("velodyne/") + file, kVelodyneDataBytes)};
}

HUELINE_BENCH_DECODE(vlp16_dual, recorded("vlp16_scans.pcap", VelodyneModel::Vlp16));
HUELINE_BENCH_DECODE(vlp16_single, recorded("vlp16_gps.pcap", VelodyneModel::Vlp16));
HUELINE_BENCH_DECODE(hdl32e_single, recorded("hdl32e.pcap", VelodyneModel::Hdl32e));
HUELINE_BENCH_DECODE(vlp32c_single, recorded("vlp32_scans.pcap", VelodyneModel::Vlp32c));
HUELINE_BENCH_DECODE(vls128_single, recorded("vls128_scans.pcap", VelodyneModel::Vls128));

}  // namespace
