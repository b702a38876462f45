#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "drivers/gige/chunk_data.hpp"
#include "drivers/gige/chunk_reader.hpp"
#include "drivers/gige/memory_device.hpp"
#include "sim/devices/camera_description.hpp"
#include "sim/devices/camera_image.hpp"

// What cameras write behind their pixels. The descriptions are made as those of several makers are: a number as it is,
// a formula over one chunk, and one over a chunk and a register of the camera.
namespace hueline::drivers {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Buffer payload_of(std::int64_t exposure_ns, float gain, bool is_big_endian, bool has_gain = true) {
  const Buffer pixels = Buffer::copy_of(std::vector<std::byte>(100, std::byte{7}));
  return sim::with_chunks(
      pixels, {.exposure_ns = exposure_ns, .gain = gain},
      {.is_active = true, .has_exposure = true, .has_gain = has_gain, .is_big_endian = is_big_endian});
}

TEST(ChunkData, ChunksAreFoundFromTheEnd) {
  for (const bool is_big_endian : {true, false}) {
    const Buffer payload = payload_of(1'234'567, 2, is_big_endian);
    const auto order = is_big_endian ? std::endian::big : std::endian::little;
    const auto chunks = read_chunks(payload.bytes(), order);
    ASSERT_EQ(chunks.size(), 3u);
    EXPECT_EQ(chunks[0].id, sim::CameraChunks::kGainId);
    EXPECT_EQ(chunks[1].id, sim::CameraChunks::kExposureId);
    EXPECT_EQ(chunks[2].id, sim::CameraChunks::kImageId);
    EXPECT_EQ(chunks[1].data.size(), 8u);
    EXPECT_EQ(chunks[2].data.data(), payload.data());
    EXPECT_EQ(chunks[2].data.size(), 100u);
  }
}

TEST(ChunkData, WhatIsCutOffEndsTheList) {
  const Buffer payload = payload_of(1, 1, true);
  for (std::size_t cut = 0; cut < payload.size(); ++cut)
    for (const Chunk& chunk : read_chunks(payload.bytes().subspan(cut), std::endian::big))
      EXPECT_GE(chunk.data.data(), payload.data() + cut);
  EXPECT_THAT(read_chunks(payload.bytes().first(7), std::endian::big), IsEmpty());
  EXPECT_THAT(read_chunks({}, std::endian::big), IsEmpty());
  // Read with the wrong order of bytes a length is far beyond the payload.
  EXPECT_THAT(read_chunks(payload.bytes(), std::endian::little), IsEmpty());
}

TEST(ChunkData, PortsOfChunksBecomeMemory) {
  const auto made = describe_chunks(
      "<Port Name=\"Device\"/> <Port Name='One' NameSpace=\"Custom\"><Description>d</Description><ChunkID> 0A01 "
      "</ChunkID></Port><Port Name=\"Event\"><EventID>9001</EventID></Port><Port Name=\"Two\">"
      "<ChunkID>0x4b2faee1</ChunkID></Port><IntReg Name=\"a\"><Address>4</Address><pPort> One </pPort></IntReg>"
      "<IntReg Name=\"b\"><pPort>Device</pPort></IntReg><IntReg Name=\"c\"><pPort>Two</pPort></IntReg>");
  EXPECT_THAT(made.ids, ElementsAre(0x0A01, 0x4b2faee1));
  EXPECT_THAT(made.text, Not(HasSubstr("ChunkID")));
  EXPECT_THAT(made.text, HasSubstr("<EventID>9001</EventID>"));
  EXPECT_THAT(made.text, HasSubstr("<Address>4</Address><Address>4611686018427387904</Address><pPort> One </pPort>"));
  EXPECT_THAT(made.text, HasSubstr("<IntReg Name=\"b\"><pPort>Device"));
  EXPECT_THAT(made.text, HasSubstr("<IntReg Name=\"c\"><Address>4611686022722355200</Address><pPort>Two"));
  EXPECT_THAT(describe_chunks("<Port Name=\"Device\"></Port><Port Name=\"x\"><ChunkID>none</ChunkID></Port>").ids,
              IsEmpty());
  for (const char* broken : {"", "<Port ", "<Port Name=\"", "<Port Name=\"a\"><ChunkID>", "<ChunkID>1</ChunkID>"})
    EXPECT_THAT(describe_chunks(broken).ids, IsEmpty()) << broken;
}

/// The registers of a camera: words at addresses, in the order of bytes of its numbers.
class Words final : public CameraMemory {
 public:
  explicit Words(std::endian order) : order_(order) {}
  std::map<std::uint64_t, std::uint32_t> words;

  Status read(std::uint64_t address, std::span<std::byte> out) override {
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t byte = (address + i) % 4;
      out[i] =
          static_cast<std::byte>(words[(address + i) / 4 * 4] >> 8 * (order_ == std::endian::big ? 3 - byte : byte));
    }
    return {};
  }
  Status write(std::uint64_t, std::span<const std::byte>) override { return {}; }

 private:
  const std::endian order_;
};

/// A camera of Aravis with this description, and the reader of its chunks.
struct Described {
  Described(const std::string& description, std::endian order) : words(order) {
    auto made = make_memory_device(words, description);
    EXPECT_TRUE(made.ok());
    device = std::move(*made);
    GError* error = nullptr;
    camera.reset(arv_camera_new_with_device(device.get(), &error));
    EXPECT_EQ(error, nullptr);
    reader = ChunkReader::make(camera.get(), order);
  }
  ImageHeader read(const Buffer& payload) const {
    ImageHeader header;
    reader->read(payload.bytes(), header);
    return header;
  }
  Words words;
  GRef<ArvDevice> device;
  GRef<ArvCamera> camera;
  std::unique_ptr<ChunkReader> reader;
};

TEST(ChunkReader, ReadsExposureAndGainOfEitherTransport) {
  for (const auto transport : {sim::CameraTransport::GigeVision, sim::CameraTransport::Usb3Vision}) {
    const bool is_big_endian = transport == sim::CameraTransport::GigeVision;
    const Described camera(sim::camera_description(transport, true, 9000),
                           is_big_endian ? std::endian::big : std::endian::little);
    ASSERT_NE(camera.reader, nullptr);
    for (const std::int64_t exposure_ns : {10'000, 1'234'000, 29'000'000}) {
      const ImageHeader header = camera.read(payload_of(exposure_ns, 4, is_big_endian));
      EXPECT_EQ(header.exposure, nanoseconds(exposure_ns));
      EXPECT_NEAR(header.gain, 4, 0.003) << "steps of 0.01 dB";
    }
    EXPECT_NEAR(camera.read(payload_of(1, 0.5f, is_big_endian)).gain, 0.5, 0.001) << "a negative number of dB";
    // The gain was not asked for; no chunk came at all; the payload is cut off.
    EXPECT_EQ(camera.read(payload_of(5000, 1, is_big_endian, false)).gain, 0);
    EXPECT_EQ(camera.read(payload_of(5000, 1, is_big_endian, false)).exposure, nanoseconds(5000));
    EXPECT_EQ(camera.read(Buffer::copy_of(std::vector<std::byte>(100))).exposure, nanoseconds(0));
    EXPECT_EQ(camera.read(payload_of(5000, 1, is_big_endian).part(0, 105)).exposure, nanoseconds(0));
  }
}

TEST(ChunkReader, ACameraWithoutTheseChunksHasNone) {
  EXPECT_EQ(Described(sim::camera_description(sim::CameraTransport::GigeVision, false, 9000), std::endian::big).reader,
            nullptr);
}

/// Returns the description of a camera whose chunks have these elements.
std::string description_of(const std::string& elements) {
  return R"(<?xml version="1.0" encoding="utf-8"?>
<RegisterDescription ModelName="m" VendorName="v" StandardNameSpace="None" SchemaMajorVersion="1" SchemaMinorVersion="1"
 SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0" SubMinorVersion="0" ToolTip="t" ProductGuid="0" VersionGuid="0"
 xmlns="http://www.genicam.org/GenApi/Version_1_0">
<Category Name="Root" NameSpace="Standard"></Category><Port Name="Device" NameSpace="Standard"></Port>)" +
         elements + "</RegisterDescription>";
}

Buffer payload_with(std::uint32_t id, const std::vector<std::uint8_t>& data) {
  std::vector<std::byte> out(10);
  for (const std::uint8_t byte : data) out.push_back(std::byte{byte});
  for (const std::uint32_t word : {id, static_cast<std::uint32_t>(data.size())})
    for (int i = 3; i >= 0; --i) out.push_back(static_cast<std::byte>(word >> 8 * i));
  return Buffer::copy_of(out);
}

TEST(ChunkReader, FormulasOverChunksAndRegistersAreCalculated) {
  const Described camera(description_of(
                             R"(<Port Name="P"><ChunkID>e0000001</ChunkID></Port>
<FloatReg Name="Seconds"><Address>4</Address><Length>4</Length><AccessMode>RO</AccessMode><pPort>P</pPort><Endianess>LittleEndian</Endianess></FloatReg>
<IntReg Name="Raw"><Address>8</Address><Length>2</Length><AccessMode>RO</AccessMode><pPort>P</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
<IntReg Name="Step"><Address>256</Address><Length>4</Length><AccessMode>RO</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
<SwissKnife Name="Us"><pVariable Name="S">Seconds</pVariable><Formula>1000000 * S</Formula></SwissKnife>
<SwissKnife Name="Db"><pVariable Name="RAW">Raw</pVariable><pVariable Name="STEP">Step</pVariable><Formula>RAW * STEP / 1000</Formula></SwissKnife>
<Float Name="ChunkExposureTime"><pValue>Us</pValue></Float><Float Name="ChunkGain"><pValue>Db</pValue></Float>)"),
                         std::endian::big);
  ASSERT_NE(camera.reader, nullptr);
  const_cast<Words&>(camera.words).words[256] = 100;  // 0.1 dB
  // 0.015625 s as a float of 32 bits, and 60 steps.
  const ImageHeader header = camera.read(payload_with(0xe0000001, {0, 0, 0, 0, 0x00, 0x00, 0x80, 0x3c, 0, 60}));
  EXPECT_EQ(header.exposure, nanoseconds(15'625'000));
  EXPECT_NEAR(header.gain, 1.995, 0.001);
  // A chunk that is shorter than its description says.
  EXPECT_EQ(camera.read(payload_with(0xe0000001, {0, 0, 0, 0, 0x00, 0x00, 0x80})).exposure, nanoseconds(0));
}

TEST(ChunkReader, TheUnitIsThatOfTheDescription) {
  const auto exposure_of = [](const char* unit) {
    const Described camera(
        description_of(
            std::string(
                R"(<Port Name="P"><ChunkID>1</ChunkID></Port><IntReg Name="Raw"><Address>0</Address><Length>4</Length>)"
                R"(<AccessMode>RO</AccessMode><pPort>P</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>)"
                R"(<Float Name="ChunkExposureTime"><pValue>Raw</pValue>)") +
            unit + "</Float>"),
        std::endian::big);
    return camera.read(payload_with(1, {0, 0, 0, 3})).exposure;
  };
  EXPECT_EQ(exposure_of(""), std::chrono::microseconds(3));
  EXPECT_EQ(exposure_of("<Unit>us</Unit>"), std::chrono::microseconds(3));
  EXPECT_EQ(exposure_of("<Unit>ms</Unit>"), std::chrono::milliseconds(3));
  EXPECT_EQ(exposure_of("<Unit>s</Unit>"), std::chrono::seconds(3));
}

}  // namespace
}  // namespace hueline::drivers
