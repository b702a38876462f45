#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "drivers/usb3_vision/gencp.hpp"
#include "drivers/usb3_vision/u3v_registers.hpp"
#include "sim/devices/u3v_registers.hpp"
#include "tests/drivers/packet_pool.hpp"
#include "tests/drivers/usb3_vision/u3v_stream.hpp"

// What of a USB3 Vision camera needs no USB: the images in the bytes of its endpoint, its commands, and its registers.
// tests/vm/usb_test has the rest.
namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using test::Bytes;
using test::Memory;
using test::Pipe;
using test::pop_all;
using test::u3v_image;
using test::u3v_pixels;
using test::U3vTold;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::size_t kPacket = 1024;

std::vector<std::string> words(const std::vector<Fault>& faults) {
  std::vector<std::string> out;
  for (const Fault& fault : faults)
    out.push_back(std::string(name(fault.kind)) + " " + std::to_string(fault.count) + ": " + fault.detail);
  return out;
}

/// A camera whose images have 100 x 41 pixels: four packets and four bytes.
class Camera {
 public:
  static constexpr std::uint32_t kWidth = 100, kHeight = 41;
  static constexpr std::size_t kPixels = 4100;

  explicit Camera(std::size_t padding = 0, std::vector<std::size_t> transfers = {kPacket, 5 * kPacket, kPacket},
                  std::size_t pool = 1 << 20)
      : memory(pool),
        assembler({.packet_bytes = kPacket, .payload_bytes = kPixels, .padding_bytes = padding}, memory),
        pipe(assembler, kPacket, std::move(transfers)),
        padding_(padding) {}

  void leader(std::uint64_t number) { pipe.send(sim::encode_u3v_leader(u3v_image(number, kWidth, kHeight))); }
  void payload(std::uint64_t number) {
    Bytes bytes = u3v_pixels(number, kPixels);
    bytes.resize(kPixels + padding_, std::byte{0xEE});
    pipe.send(bytes);
  }
  void trailer(std::uint64_t number, std::uint64_t valid = kPixels) {
    pipe.send(sim::encode_u3v_trailer(u3v_image(number, kWidth, kHeight), valid));
  }
  void image(std::uint64_t number) {
    leader(number);
    payload(number);
    trailer(number);
  }
  U3vTold told() { return pop_all(assembler); }

  Memory memory;
  U3vAssembler assembler;
  Pipe pipe;

 private:
  const std::size_t padding_;
};

void expect_whole(const U3vTold::Image& image, std::uint64_t number) {
  EXPECT_EQ(image.header.status, ImageStatus::Complete);
  EXPECT_EQ(image.header.frame_id, number);
  EXPECT_EQ(count_ns(image.header.time), static_cast<std::int64_t>((number << 33) + 5));
  EXPECT_EQ(image.header.width, Camera::kWidth);
  EXPECT_EQ(image.header.height, Camera::kHeight);
  EXPECT_EQ(image.header.stride, Camera::kWidth);
  EXPECT_EQ(image.header.offset_x, 16u);
  EXPECT_EQ(image.header.offset_y, 8u);
  EXPECT_EQ(image.header.pfnc, test::kBayerRG8);
  EXPECT_TRUE(image.pixels == u3v_pixels(number, Camera::kPixels)) << number;
}
std::vector<std::uint64_t> numbers(const U3vTold& told, ImageStatus status = ImageStatus::Complete) {
  std::vector<std::uint64_t> out;
  for (const auto& image : told.images)
    if (image.header.status == status) out.push_back(image.header.frame_id);
  return out;
}

TEST(U3vAssembler, FindsTheImagesHoweverTransfersCutTheStream) {
  // Without padding the payload ends with a short packet; filled up to the packet it ends with a whole one.
  for (const std::size_t padding :
       {std::size_t{0}, std::size_t{60}, 5 * kPacket - Camera::kPixels, 8 * kPacket - Camera::kPixels})
    for (const std::vector<std::size_t>& transfers : {std::vector<std::size_t>{kPacket, 5 * kPacket, kPacket},
                                                      {kPacket},
                                                      {2 * kPacket, 3 * kPacket},
                                                      {64 * kPacket},
                                                      {kPacket, 4 * kPacket, kPacket, 2 * kPacket}}) {
      Camera camera(padding, transfers);
      for (std::uint64_t i = 7; i < 20; ++i) camera.image(i);
      const U3vTold told = camera.told();
      ASSERT_EQ(told.images.size(), 13u) << padding << " " << transfers.size();
      for (std::uint64_t i = 0; i < 13; ++i) expect_whole(told.images[i], 7 + i);
      EXPECT_THAT(words(told.faults), ElementsAre());
    }
}

TEST(U3vAssembler, WhatIsMissingIsToldAndTheImagesAroundItAreWhole) {
  Camera camera;
  camera.image(1);
  camera.payload(2);  // no leader
  camera.trailer(2);
  camera.image(3);
  camera.leader(4);  // no trailer
  camera.payload(4);
  camera.image(5);
  camera.leader(6);  // half of the payload, as the trailer says
  camera.pipe.send(u3v_pixels(6, 2050));
  camera.trailer(6, 2050);
  camera.leader(7);  // no payload
  camera.trailer(7, 0);
  camera.leader(8);  // nothing but the leader
  camera.leader(9);
  camera.payload(9);
  camera.trailer(10);  // the end of another
  camera.image(11);
  const U3vTold told = camera.told();
  EXPECT_THAT(numbers(told), ElementsAre(1, 3, 5, 11));
  EXPECT_THAT(numbers(told, ImageStatus::MissingPackets), ElementsAre(4, 6, 7, 8));
  EXPECT_THAT(numbers(told, ImageStatus::Broken), ElementsAre(9));
  EXPECT_THAT(words(told.faults),
              ElementsAre("Malformed 4132: 4132 bytes on USB belong to no image: no leader came before them",
                          "Lost 1: image 4 is not whole: the next image began before its end had come",
                          "Lost 1: image 6 is not whole: 2050 of 4100 bytes came",
                          "Lost 1: image 7 is not whole: 0 of 4100 bytes came",
                          "Lost 1: image 8 is not whole: the next image began before its end had come",
                          "Lost 1: image 9 is not whole: its end is that of image 10"));
  EXPECT_EQ(camera.memory.bytes_in_use(), 0u);
}

TEST(U3vAssembler, AnInterruptionEndsTheImageThatIsUnderWay) {
  Camera camera;
  camera.leader(1);
  camera.assembler.take(Bytes(2 * kPacket), false, host_time_ns(1));
  camera.assembler.interrupt("the camera halted its endpoint", host_time_ns(2));
  camera.assembler.interrupt("a transfer failed", host_time_ns(3));
  Camera again;  // the transfers begin anew
  const U3vTold told = camera.told();
  EXPECT_THAT(numbers(told, ImageStatus::MissingPackets), ElementsAre(1));
  EXPECT_THAT(words(told.faults), ElementsAre("Lost 1: image 1 is not whole: the camera halted its endpoint",
                                              "Malformed 1: a transfer failed: bytes are missing"));
}

TEST(U3vAssembler, AnImageLargerThanTheCameraWasSetToIsNotUsed) {
  Camera camera;
  camera.pipe.send(sim::encode_u3v_leader(u3v_image(1, 100, 42)));
  camera.payload(1);
  camera.trailer(1);
  camera.leader(2);
  camera.pipe.send(u3v_pixels(2, 6 * kPacket));
  camera.trailer(2);
  camera.image(3);
  const U3vTold told = camera.told();
  EXPECT_THAT(numbers(told), ElementsAre(3));
  EXPECT_THAT(numbers(told, ImageStatus::Broken), ElementsAre(1, 2));
  EXPECT_THAT(words(told.faults),
              ElementsAre("Lost 1: image 1 is not whole: it is larger than the size that the camera was set to",
                          "Lost 1: image 2 is not whole: it is larger than the camera announced",
                          HasSubstr("bytes on USB belong to no image")));
}

TEST(U3vAssembler, WithoutMemoryAnImageIsToldAndTheNextIsWhole) {
  Camera camera(0, {kPacket, 5 * kPacket, kPacket}, 8192);  // one image
  camera.image(1);
  camera.image(2);
  U3vTold told = camera.told();
  EXPECT_THAT(numbers(told), ElementsAre(1));
  EXPECT_THAT(words(told.faults), ElementsAre(HasSubstr("Overflow 1: an image found no free buffer")));
  camera.image(3);
  EXPECT_THAT(numbers(camera.told()), ElementsAre(3));
}

TEST(U3vAssembler, ChunksBehindAnImageAreLeftOutAndAPayloadWithoutImageIsTold) {
  Bytes leader = sim::encode_u3v_leader(u3v_image(1, 100, 40));
  leader[18] = std::byte{0x01}, leader[19] = std::byte{0x40};  // an image with chunks: 4000 bytes, and 100
  Camera camera;
  camera.pipe.send(leader);
  camera.payload(1);
  camera.trailer(1);
  leader[18] = std::byte{0x00};  // chunks alone
  camera.pipe.send(leader);
  const U3vTold told = camera.told();
  ASSERT_THAT(numbers(told), ElementsAre(1));
  Bytes pixels = u3v_pixels(1, Camera::kPixels);
  pixels.resize(4000);
  EXPECT_TRUE(told.images[0].pixels == pixels);
  EXPECT_THAT(words(told.faults), ElementsAre(HasSubstr("a payload of type 0x4000, which is no image")));
}

/// The control channel of the simulator's camera, whose answers can go wrong.
class Channel final : public MessageChannel {
 public:
  Status send(std::span<const std::byte> message) override {
    ++commands;
    largest = std::max(largest, message.size());
    Bytes copy(message.begin(), message.end());
    if (is_deaf) return {};
    answers.push_back(answer(copy));
    if (disturb) disturb(answers);
    return {};
  }
  Result<std::size_t> receive(std::span<std::byte> out, milliseconds limit) override {
    waited.push_back(limit);
    if (answers.empty()) return Error{ErrorCode::TimedOut, "nothing"};
    const Bytes message = std::move(answers.front());
    answers.pop_front();
    if (message.size() > out.size()) return Error{ErrorCode::Io, "too long"};
    std::ranges::copy(message, out.begin());
    largest = std::max(largest, message.size());
    return message.size();
  }

  std::unique_ptr<sim::U3vRegisters> registers =
      sim::U3vRegisters::create({.serial = "HL02", .width = 640, .height = 480}).value();
  bool is_deaf = false;
  std::function<void(std::deque<Bytes>&)> disturb;
  std::deque<Bytes> answers;
  std::vector<milliseconds> waited;
  std::size_t commands = 0, largest = 0;

 private:
  template <class T>
  static T get(const Bytes& bytes, std::size_t at) {
    T value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
  }
  Bytes answer(const Bytes& command) {
    const auto kind = get<std::uint16_t>(command, 6), number = get<std::uint16_t>(command, 10);
    const auto address = get<std::uint64_t>(command, 12);
    EXPECT_EQ(get<std::uint32_t>(command, 0), 0x43563355u);
    EXPECT_EQ(get<std::uint16_t>(command, 4), 0x4000u) << "an answer is wanted";
    EXPECT_EQ(get<std::uint16_t>(command, 8), command.size() - 12);
    Bytes data;
    sim::GencpStatus status = sim::GencpStatus::NotImplemented;
    if (kind == 0x0800) {
      data.resize(get<std::uint16_t>(command, 22));
      status = registers->read(address, data);
    } else if (kind == 0x0802) {
      status = registers->write(address, std::span(command).subspan(20));
    }
    if (status != sim::GencpStatus::Success) data.clear();
    return sim::encode_gencp_acknowledge(kind, status, number, data);
  }
};

TEST(Gencp, ReadsAndWritesWhatTheCameraHasInMessagesThatItCanTake) {
  Channel channel;
  GencpClient client(channel);
  const auto bootstrap = read_bootstrap(client);
  ASSERT_TRUE(bootstrap.ok()) << bootstrap.error().message;
  EXPECT_LE(channel.largest, 128u) << "before the camera has said what it can take";
  EXPECT_EQ(bootstrap->limits.command_bytes, 1024u);
  client.set_limits(bootstrap->limits);
  const auto description = read_description(client, bootstrap->manifest);
  ASSERT_TRUE(description.ok()) << description.error().message;
  EXPECT_THAT(*description, testing::StartsWith("<?xml"));
  EXPECT_THAT(*description, HasSubstr("</RegisterDescription>"));
  EXPECT_GT(channel.largest, 900u);
  EXPECT_LE(channel.largest, 1024u);
}

TEST(Gencp, WhatTheCameraRefusesIsSaid) {
  Channel channel;
  GencpClient client(channel);
  Bytes four(4);
  const Status absent = client.read(0xFFFF'0000'0000, four);
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, ErrorCode::Invalid);
  EXPECT_THAT(absent.error().message, HasSubstr("read its memory at 0xffff00000000: it has no such address"));
  const Status locked = client.write(0, four);
  ASSERT_FALSE(locked.ok());
  EXPECT_EQ(locked.error().code, ErrorCode::Invalid);
  EXPECT_THAT(locked.error().message, HasSubstr("cannot be written"));
  EXPECT_EQ(channel.commands, 2u) << "what is refused is not asked again";
}

TEST(Gencp, ALateAnswerIsIgnoredALostOneAskedForAgainAndAPendingOneWaitedFor) {
  Channel channel;
  GencpClient client(channel);
  Bytes serial(4);
  const auto reads = [&] { return client.read(sim::u3v_register::kSerial, serial); };
  int turn = 0;
  channel.disturb = [&](std::deque<Bytes>& answers) {
    if (turn++ == 0) answers.pop_front();
  };
  ASSERT_TRUE(reads().ok());
  EXPECT_EQ(channel.commands, 2u);
  channel.disturb = [&](std::deque<Bytes>& answers) {
    Bytes late = answers.front();
    late[10] = static_cast<std::byte>(std::to_integer<int>(late[10]) - 1);
    late[12] = std::byte{'X'};
    answers.push_front(Bytes(3));
    answers.push_front(late);
  };
  ASSERT_TRUE(reads().ok());
  EXPECT_EQ(channel.commands, 3u);
  EXPECT_EQ(std::to_integer<char>(serial[0]), 'H');
  channel.disturb = [&](std::deque<Bytes>& answers) {
    const auto number = static_cast<std::uint16_t>(std::to_integer<int>(answers.front()[10]) +
                                                   256 * std::to_integer<int>(answers.front()[11]));
    answers.push_front(sim::encode_gencp_pending(number, 4321));
  };
  ASSERT_TRUE(reads().ok());
  EXPECT_EQ(channel.waited.back(), milliseconds(4321));
  channel.is_deaf = true;
  const Status deaf = reads();
  ASSERT_FALSE(deaf.ok());
  EXPECT_EQ(deaf.error().code, ErrorCode::TimedOut);
  EXPECT_THAT(deaf.error().message, HasSubstr("the camera does not answer: 3 tries"));
}

TEST(Gencp, AnswersThatAreNoneEndWithAnError) {
  std::mt19937 random(5);
  for (int turn = 0; turn < 3000; ++turn) {
    Channel channel;
    GencpClient client(channel);
    channel.disturb = [&](std::deque<Bytes>& answers) {
      Bytes& answer = answers.back();
      if (random() % 4 == 0) answer.resize(random() % (answer.size() + 1));
      for (std::uint32_t i = 0; i < random() % 4 && !answer.empty(); ++i)
        answer[random() % answer.size()] = static_cast<std::byte>(random());
      if (random() % 8 == 0) answers.push_back(answer);
    };
    const auto bootstrap = read_bootstrap(client);
    if (!bootstrap) continue;
    client.set_limits(bootstrap->limits);
    (void)set_up_stream(client, bootstrap->stream, kPacket);
    (void)read_description(client, bootstrap->manifest);
  }
}

TEST(U3vRegisters, TheCameraIsToldHowItsImagesAreAskedFor) {
  Channel channel;
  GencpClient client(channel);
  const auto bootstrap = read_bootstrap(client);
  ASSERT_TRUE(bootstrap.ok());
  const auto word = [&](std::uint32_t at) { return channel.registers->get(sim::u3v_register::kStream + at); };
  const auto shape = set_up_stream(client, bootstrap->stream, kPacket);
  ASSERT_TRUE(shape.ok()) << shape.error().message;
  EXPECT_EQ(shape->payload_bytes, 640u * 480u);
  EXPECT_THAT(shape->transfer_bytes, ElementsAre(1024, 262'144, 45'056, 1024));
  EXPECT_EQ(shape->padding_bytes, 0u);
  EXPECT_EQ(word(0x1C) * word(0x20) + word(0x24) + word(0x28), 640u * 480u);
  EXPECT_EQ(word(0x18), 1024u);
  EXPECT_EQ(word(0x2C), 1024u);
  ASSERT_TRUE(set_streaming(client, bootstrap->stream, true).ok());
  EXPECT_EQ(word(0x04), 1u);
  ASSERT_TRUE(set_streaming(client, bootstrap->stream, false).ok());
  EXPECT_EQ(word(0x04), 0u);
  // One that sends blocks of 4096 bytes fills the last one up.
  channel.registers->set(sim::u3v_register::kStream, 12U << 24U);
  channel.registers->set(sim::camera_register::kHeight, 479);
  const auto aligned = set_up_stream(client, bootstrap->stream, kPacket);
  ASSERT_TRUE(aligned.ok()) << aligned.error().message;
  EXPECT_EQ(aligned->padding_bytes, 640u);
  EXPECT_EQ(word(0x1C) * word(0x20) + word(0x24), 640u * 480u);
  channel.registers->set(sim::u3v_register::kStream, 200U << 24U);
  EXPECT_FALSE(set_up_stream(client, bootstrap->stream, kPacket).ok());
}

std::string from_hex(std::string_view hex) {
  std::string out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    out.push_back(static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  return out;
}

TEST(U3vRegisters, ADescriptionFileIsUnpacked) {
  // c.xml with "<x>", 30 times "ab", "</x>", as Python's zipfile packs it, deflated and stored.
  const std::string deflated = from_hex(
      "504b03041400000008000000215062dc11460d0000004300000005000000632e786d6cb3a9b04b4c221fdae857d80100504b0102140314"
      "00000008000000215062dc11460d00000043000000050000000000000000000000800100000000632e786d6c504b050600000000010001"
      "0033000000300000000000");
  const std::string stored = from_hex(
      "504b03041400000000000000215062dc1146430000004300000005000000632e786d6c3c783e6162616261626162616261626162616261"
      "626162616261626162616261626162616261626162616261626162616261626162616261626162616261623c2f783e504b010214031400"
      "000000000000215062dc11464300000043000000050000000000000000000000800100000000632e786d6c504b05060000000001000100"
      "33000000660000000000");
  std::string text = "<x>";
  for (int i = 0; i < 30; ++i) text += "ab";
  text += "</x>";
  for (const std::string& archive : {deflated, stored}) {
    const auto unpacked = unzip(archive);
    ASSERT_TRUE(unpacked.ok()) << unpacked.error().message;
    EXPECT_EQ(*unpacked, text);
    for (std::size_t size = 0; size < archive.size(); ++size) EXPECT_FALSE(unzip(archive.substr(0, size)).ok()) << size;
    std::mt19937 random(3);
    for (int turn = 0; turn < 2000; ++turn) {
      std::string damaged = archive;
      for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
      (void)unzip(damaged);
    }
  }
}

}  // namespace
}  // namespace hueline::drivers
