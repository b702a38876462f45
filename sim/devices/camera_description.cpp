#include "sim/devices/camera_description.hpp"

#include <fmt/format.h>

#include <initializer_list>
#include <string_view>
#include <utility>

#include "sim/devices/camera_registers.hpp"
#include "sim/devices/u3v_registers.hpp"

namespace hueline::sim {
namespace {

namespace reg = camera_register;

/// Writes the description, one feature after the other: the register behind a feature and what a client is told about
/// it.
class Description {
 public:
  explicit Description(CameraTransport transport)
      : byte_order_(transport == CameraTransport::GigeVision ? "BigEndian" : "LittleEndian") {}

  /// Adds a register of four bytes that is no feature itself.
  void word(std::string_view name, std::uint32_t address, std::string_view access = "RW") {
    text_ += fmt::format(
        R"(<IntReg Name="{}"><Address>{:#x}</Address><Length>4</Length><AccessMode>{}</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>)"
        R"(<Sign>Unsigned</Sign><Endianess>{}</Endianess></IntReg>)"
        "\n",
        name, address, access, byte_order_);
  }
  /// Adds bits of a big-endian register, counted from the most significant one.
  void bits(std::string_view name, std::uint32_t address, int first, int last) {
    text_ += fmt::format(
        R"(<MaskedIntReg Name="{}"><Address>{:#x}</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>)"
        R"(<LSB>{}</LSB><MSB>{}</MSB><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></MaskedIntReg>)"
        "\n",
        name, address, last, first);
  }
  void text(std::string_view name, std::uint32_t address, int length) {
    feature(name);
    text_ += fmt::format(
        R"(<StringReg Name="{}" NameSpace="Standard"><Address>{:#x}</Address><Length>{}</Length><AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>)"
        "\n",
        name, address, length);
  }
  /// Adds a whole number. `limits` are GenApi elements with a number or another feature.
  void integer(std::string_view name, std::string_view register_name, std::string_view limits) {
    feature(name);
    text_ += fmt::format(R"(<Integer Name="{}" NameSpace="Standard"><pValue>{}</pValue>{}</Integer>)"
                         "\n",
                         name, register_name, limits);
  }
  void integer(std::string_view name, std::uint32_t address, std::string_view limits, std::string_view access = "RW") {
    word(fmt::format("{}Reg", name), address, access);
    integer(name, fmt::format("{}Reg", name), limits);
  }
  void choice(std::string_view name, std::uint32_t address,
              std::initializer_list<std::pair<std::string_view, std::uint32_t>> entries) {
    word(fmt::format("{}Reg", name), address);
    feature(name);
    text_ += fmt::format(R"(<Enumeration Name="{}" NameSpace="Standard">)", name);
    for (const auto& [entry, value] : entries)
      text_ += fmt::format(R"(<EnumEntry Name="{}" NameSpace="Standard"><Value>{}</Value></EnumEntry>)", entry, value);
    text_ += fmt::format("<pValue>{}Reg</pValue></Enumeration>\n", name);
  }
  void command(std::string_view name, std::string_view register_name, int value) {
    feature(name);
    text_ += fmt::format(
        R"(<Command Name="{}" NameSpace="Standard"><pValue>{}</pValue><CommandValue>{}</CommandValue></Command>)"
        "\n",
        name, register_name, value);
  }
  /// Adds a number; the formulas `to_register` and `from_register` convert between it and its register.
  void number(std::string_view name, std::uint32_t address, std::string_view to_register,
              std::string_view from_register, std::string_view limits) {
    word(fmt::format("{}Reg", name), address);
    feature(name);
    text_ += fmt::format(
        R"(<Converter Name="{0}Conversion"><FormulaTo>{1}</FormulaTo><FormulaFrom>{2}</FormulaFrom><pValue>{0}Reg</pValue></Converter>)"
        R"(<Float Name="{0}" NameSpace="Standard"><pValue>{0}Conversion</pValue>{3}</Float>)"
        "\n",
        name, to_register, from_register, limits);
  }
  /// Adds exposure and gain as chunks: their switches, and where their numbers lie in a chunk.
  void chunks() {
    word("ChunkModeReg", reg::kChunkMode);
    raw("ChunkModeActive",
        R"(<Boolean Name="ChunkModeActive" NameSpace="Standard"><pValue>ChunkModeReg</pValue></Boolean>)");
    choice("ChunkSelector", reg::kChunkSelector, {{"ExposureTime", 0}, {"Gain", 1}});
    word("ChunkExposureOnReg", reg::kChunkEnable);
    word("ChunkGainOnReg", reg::kChunkEnable + 4);
    raw("ChunkEnable",
        fmt::format(
            R"(<IntSwissKnife Name="ChunkEnableAddress"><pVariable Name="CHOSEN">ChunkSelectorReg</pVariable>)"
            R"(<Formula>{} + 4 * CHOSEN</Formula></IntSwissKnife>)"
            R"(<IntReg Name="ChunkEnableReg"><pAddress>ChunkEnableAddress</pAddress><Length>4</Length><AccessMode>RW</AccessMode>)"
            R"(<pPort>Device</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>{}</Endianess></IntReg>)"
            R"(<Boolean Name="ChunkEnable" NameSpace="Standard"><pValue>ChunkEnableReg</pValue></Boolean>)",
            reg::kChunkEnable, byte_order_));
    chunk("ChunkExposureTime", CameraChunks::kExposureId, CameraChunks::kExposureBytes, "Unsigned", "us", "RAW / 1000");
    chunk("ChunkGain", CameraChunks::kGainId, CameraChunks::kGainBytes, "Signed", "dB", "RAW / 100");
  }
  void raw(std::string_view feature_name, std::string_view xml) {
    feature(feature_name);
    text_ += fmt::format("{}\n", xml);
  }

  std::string whole() const {
    return fmt::format(
        R"(<?xml version="1.0" encoding="utf-8"?>
<RegisterDescription ModelName="{}" VendorName="{}" StandardNameSpace="None" SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0"
 MajorVersion="1" MinorVersion="0" SubMinorVersion="0" ToolTip="Emulated camera" ProductGuid="0" VersionGuid="0"
 xmlns="http://www.genicam.org/GenApi/Version_1_0">
<Category Name="Root" NameSpace="Standard">{}</Category>
{}<Port Name="Device" NameSpace="Standard"></Port>
</RegisterDescription>
)",
        kCameraModel, kCameraMaker, features_, text_);
  }

 private:
  void chunk(std::string_view name, std::uint32_t id, std::size_t size, std::string_view sign, std::string_view unit,
             std::string_view formula) {
    raw(name,
        fmt::format(
            R"(<Port Name="{0}Port" NameSpace="Standard"><ChunkID>{1:08x}</ChunkID></Port>)"
            R"(<IntReg Name="{0}Raw"><Address>0x0</Address><Length>{2}</Length><AccessMode>RO</AccessMode>)"
            R"(<pPort>{0}Port</pPort><Cachable>NoCache</Cachable><Sign>{3}</Sign><Endianess>{4}</Endianess></IntReg>)"
            R"(<SwissKnife Name="{0}Value"><pVariable Name="RAW">{0}Raw</pVariable><Formula>{5}</Formula></SwissKnife>)"
            R"(<Float Name="{0}" NameSpace="Standard"><pValue>{0}Value</pValue><Unit>{6}</Unit></Float>)",
            name, id, size, sign, byte_order_, formula, unit));
  }
  void feature(std::string_view name) { features_ += fmt::format("<pFeature>{}</pFeature>", name); }
  const std::string_view byte_order_;
  std::string features_, text_;
};

/// Adds who the camera is, which each transport keeps in registers of its own.
void add_identity(Description& d, CameraTransport transport) {
  if (transport == CameraTransport::GigeVision) {
    d.text("DeviceVendorName", reg::kMaker, 32);
    d.text("DeviceModelName", reg::kModel, 32);
    d.text("DeviceVersion", reg::kVersion, 32);
    d.text("DeviceManufacturerInfo", reg::kMakerInformation, 48);
    d.text("DeviceID", reg::kSerial, 16);
  } else {
    d.text("DeviceVendorName", u3v_register::kMaker, 64);
    d.text("DeviceModelName", u3v_register::kModel, 64);
    d.text("DeviceVersion", u3v_register::kVersion, 64);
    d.text("DeviceManufacturerInfo", u3v_register::kMakerInformation, 64);
    d.text("DeviceSerialNumber", u3v_register::kSerial, 64);
  }
}

/// Adds the size of the packets that a GigE Vision camera sends.
void add_packet_size(Description& d, std::uint32_t max_packet_bytes) {
  d.bits("StreamPacketSizeBits", reg::kStreamPacketSize, 16, 31);
  d.bits("StreamFireTestBit", reg::kStreamPacketSize, 0, 0);
  d.integer("GevSCPSPacketSize", "StreamPacketSizeBits",
            fmt::format("<Min>576</Min><Max>{}</Max><Inc>4</Inc>", max_packet_bytes));
  d.command("GevSCPSFireTestPacket", "StreamFireTestBit", 1);
}

}  // namespace

std::string camera_description(CameraTransport transport, bool has_chunks, std::uint32_t max_packet_bytes) {
  Description d(transport);
  add_identity(d, transport);

  d.integer("SensorWidth", reg::kSensorWidth, "", "RO");
  d.integer("SensorHeight", reg::kSensorHeight, "", "RO");
  d.integer("Width", reg::kWidth, "<Min>1</Min><pMax>SensorWidth</pMax><Inc>1</Inc>");
  d.integer("Height", reg::kHeight, "<Min>1</Min><pMax>SensorHeight</pMax><Inc>1</Inc>");
  d.integer("OffsetX", reg::kOffsetX, "<Min>0</Min><pMax>SensorWidth</pMax><Inc>1</Inc>");
  d.integer("OffsetY", reg::kOffsetY, "<Min>0</Min><pMax>SensorHeight</pMax><Inc>1</Inc>");
  d.choice("PixelFormat", reg::kPixelFormat,
           {{"Mono8", reg::kMono8},
            {"BayerGR8", reg::kBayerGR8},
            {"BayerRG8", reg::kBayerRG8},
            {"BayerGB8", reg::kBayerGB8},
            {"BayerBG8", reg::kBayerBG8}});

  d.choice("AcquisitionMode", reg::kAcquisitionMode, {{"Continuous", 1}, {"SingleFrame", 2}, {"MultiFrame", 3}});
  d.word("AcquisitionReg", reg::kAcquisition, "WO");
  d.command("AcquisitionStart", "AcquisitionReg", 1);
  d.command("AcquisitionStop", "AcquisitionReg", 0);
  d.number("AcquisitionFrameRate", reg::kFrameRateMilliHz, "FROM * 1000", "TO / 1000", "<Min>0.1</Min><Max>1000</Max>");
  d.raw(
      "TriggerSelector",
      R"(<Integer Name="TriggerSelectorValue"><Value>0</Value></Integer><Enumeration Name="TriggerSelector" NameSpace="Standard">)"
      R"(<EnumEntry Name="FrameStart" NameSpace="Standard"><Value>0</Value></EnumEntry>)"
      R"(<pValue>TriggerSelectorValue</pValue></Enumeration>)");
  d.choice("TriggerMode", reg::kTriggerMode, {{"Off", 0}, {"On", 1}});
  d.choice("TriggerSource", reg::kTriggerSource, {{"Line0", 0}, {"Software", 1}});
  d.choice("TriggerActivation", reg::kTriggerActivation, {{"RisingEdge", 0}, {"FallingEdge", 1}});
  d.number("ExposureTimeAbs", reg::kExposureUs, "FROM", "TO", "<Min>10</Min><Max>10000000</Max>");
  d.integer("GainRaw", reg::kGain, "<Min>0</Min><Max>10</Max>");
  d.choice("GainAuto", reg::kGainAuto, {{"Off", 1}, {"Continuous", 2}, {"Once", 3}});

  d.choice("ExposureAuto", reg::kExposureAuto, {{"Off", 1}, {"Continuous", 2}, {"Once", 3}});
  d.number("AutoExposureTimeUpperLimit", reg::kExposureLimitUs, "FROM", "TO", "<Min>10</Min><Max>10000000</Max>");
  if (has_chunks) d.chunks();
  d.raw(
      "PayloadSize",
      fmt::format(
          R"(<IntSwissKnife Name="PayloadSize" NameSpace="Standard"><pVariable Name="WIDTH">Width</pVariable>)"
          R"(<pVariable Name="HEIGHT">Height</pVariable><pVariable Name="FORMAT">PixelFormat</pVariable>{})"
          R"(<Formula>WIDTH * HEIGHT * ((FORMAT &gt;&gt; 16) &amp; 0xFF) / 8{}</Formula></IntSwissKnife>)",
          has_chunks
              ? R"(<pVariable Name="ON">ChunkModeReg</pVariable><pVariable Name="EXPOSURE">ChunkExposureOnReg</pVariable>)"
                R"(<pVariable Name="GAIN">ChunkGainOnReg</pVariable>)"
              : "",
          has_chunks ? " + ON * (8 + EXPOSURE * 16 + GAIN * 12)" : ""));
  d.raw("TLParamsLocked", R"(<Integer Name="TLParamsLocked"><Value>0</Value><Min>0</Min><Max>1</Max></Integer>)");
  if (transport == CameraTransport::GigeVision) add_packet_size(d, max_packet_bytes);
  return d.whole();
}

}  // namespace hueline::sim
