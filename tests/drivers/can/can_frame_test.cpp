// Frames in their two kinds of packets and in logs, and what error frames report.
#include "drivers/can/can_frame.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>

#include "drivers/can/can_errors.hpp"
#include "tests/drivers/can/can_frames.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::bytes_of;
using test::can_error;
using test::can_frame;

TEST(CanPacket, HoldsTheKernelsOwnFrame) {
  CanFrame frame = can_frame(0x18FEBF0B, {1, 2, 3, 4, 5});
  frame.is_extended = true;
  frame.adapter_time = DeviceTime<CanAdapterCounter>(nanoseconds(123'456'789'012));
  const auto bytes = encode_can_packet(frame);
  ASSERT_EQ(bytes.size(), 32u);
  ::can_frame kernel{};
  std::memcpy(&kernel, bytes.data() + kCanHeaderSize, sizeof(kernel));
  EXPECT_EQ(kernel.can_id, 0x18FEBF0B | CAN_EFF_FLAG);
  EXPECT_EQ(kernel.len, 5);
  EXPECT_EQ(kernel.data[4], 5);
  CanPacket out;
  ASSERT_TRUE(decode_can_packet(bytes, out).ok());
  ASSERT_EQ(out.frames.size(), 1u);
  EXPECT_EQ(out.frames[0].id, 0x18FEBF0Bu);
  EXPECT_TRUE(out.frames[0].is_extended);
  EXPECT_EQ(out.frames[0].adapter_time, frame.adapter_time);
  EXPECT_EQ(out.frames[0].packet_bytes, 32u);
  EXPECT_EQ(name(out.frames[0]), "18FEBF0B");

  frame = can_frame(0x7FF, {});
  frame.is_fd = true;
  frame.length = 64;
  frame.data[63] = 9;
  ASSERT_TRUE(decode_can_packet(encode_can_packet(frame), out).ok());
  EXPECT_EQ(out.frames[0].length, 64);
  EXPECT_EQ(out.frames[0].data[63], 9);
  EXPECT_TRUE(out.frames[0].is_fd);
}

TEST(CanPacket, BrokenOnesAreRefused) {
  CanPacket out;
  auto bytes = encode_can_packet(can_frame(1, {1}));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_can_packet(std::span(bytes).first(size), out).ok()) << size;
  bytes[kCanHeaderSize + 4] = std::byte{9};  // data bytes of a classic frame
  EXPECT_FALSE(decode_can_packet(bytes, out).ok());
}

// Written by hand from the gateway's description of its format.
const std::vector<std::byte> kDatagram =
    bytes_of({2,    0,    7,    0,    4,                      // version, data, number, 4 frames
              0,    0,    0,    0xB2, 2,         0xAA, 0xBB,  // 0B2, two bytes
              0x98, 0xFE, 0xBF, 0x0B, 1,         5,           // 29 bits
              0,    0,    1,    0x23, 0x80 | 12, 1,    1,    2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12,  // FD, flags
              0x40, 0,    3,    0x21, 4});  // remote: a length, no data

TEST(CanPacket, ADatagramOfAGatewayHoldsSeveral) {
  CanPacket out;
  const Status decoded = decode_can_packet(kDatagram, out);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(out.datagram_sequence, 7);
  ASSERT_EQ(out.frames.size(), 4u);
  EXPECT_EQ(out.frames[0].id, 0xB2u);
  EXPECT_EQ(out.frames[0].bytes()[1], 0xBB);
  EXPECT_EQ(out.frames[1].id, 0x18FEBF0Bu);
  EXPECT_TRUE(out.frames[1].is_extended);
  EXPECT_TRUE(out.frames[2].is_fd);
  EXPECT_EQ(out.frames[2].length, 12);
  EXPECT_EQ(out.frames[2].data[11], 12);
  EXPECT_TRUE(out.frames[3].is_remote);
  std::size_t sum = out.header_bytes;
  for (const CanFrame& frame : out.frames) sum += frame.packet_bytes;
  EXPECT_EQ(sum, kDatagram.size());
}

TEST(CanPacket, ADatagramCutAnywhereGivesItsWholeFrames) {
  CanPacket out;
  for (std::size_t size = 0; size < kDatagram.size(); ++size) {
    EXPECT_FALSE(decode_can_packet(std::span(kDatagram).first(size), out).ok()) << size;
    EXPECT_EQ(out.frames.size(), size < 12 ? 0u : size < 18 ? 1u : size < 36 ? 2u : 3u) << size;
  }
  auto longer = kDatagram;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decode_can_packet(longer, out).ok());
}

TEST(CanErrors, AreSaidInWords) {
  auto said = explain_can_error(can_error(CAN_ERR_BUSOFF));
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0].kind, FaultKind::Disconnected);
  EXPECT_NE(said[0].detail.find("bus-off"), std::string::npos);
  EXPECT_EQ(explain_can_error(can_error(CAN_ERR_RESTARTED)).at(0).kind, FaultKind::Reconnected);
  EXPECT_EQ(explain_can_error(can_error(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_RX_OVERFLOW, 0, 0, 0, 0, 0, 0})).at(0).kind,
            FaultKind::Lost);
  said = explain_can_error(can_error(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_PASSIVE, 0, 0, 0, 0, 130, 12}));
  EXPECT_EQ(said.at(0).kind, FaultKind::Malformed);
  EXPECT_NE(said[0].detail.find("error passive; its error counters: 130 sending, 12 receiving"), std::string::npos)
      << said[0].detail;
  said = explain_can_error(can_error(CAN_ERR_PROT | CAN_ERR_BUSERROR, {0, 0, CAN_ERR_PROT_STUFF, 0, 0, 0, 0, 0}));
  EXPECT_NE(said.at(0).detail.find("(stuffing)"), std::string::npos) << said[0].detail;
  EXPECT_TRUE(explain_can_error(can_error(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_ACTIVE, 0, 0, 0, 0, 0, 0})).empty());
}

std::map<std::string, int> names(const std::vector<Packet>& packets) {
  std::map<std::string, int> out;
  for (const Packet& packet : packets) {
    CanPacket parsed;
    EXPECT_TRUE(decode_can_packet(packet.bytes.bytes(), parsed).ok());
    for (const CanFrame& frame : parsed.frames) ++out[frame.is_error ? "error" : name(frame)];
  }
  return out;
}

TEST(CanLog, ARealRecordingIsReadWhole) {
  HUELINE_REQUIRE_DATA("can/issue_1256.asc");
  std::vector<Fault> faults;
  const auto packets = test::read_can_log(data_file.string(), faults);
  EXPECT_TRUE(faults.empty());
  // The expected numbers are those of `awk '{print $3}' | sort | uniq -c`.
  EXPECT_EQ(names(packets), (std::map<std::string, int>{
                                {"010", 79}, {"011", 265}, {"012", 159}, {"064", 795}, {"065", 79}, {"066", 80}}));
  EXPECT_EQ(packets.front().received, HostTime(nanoseconds(19'968'000)));
  EXPECT_EQ(packets.back().received, HostTime(nanoseconds(7'960'498'000)));
  EXPECT_TRUE(test::read_can_log(data_file.string(), faults, 2).empty()) << "another channel";
}

TEST(CanLog, ErrorFramesOfARealLogAreFound) {
  HUELINE_REQUIRE_DATA("can/test_CanErrorFrames.asc");
  std::vector<Fault> faults;
  const auto packets = test::read_can_log(data_file.string(), faults);
  EXPECT_EQ(names(packets), (std::map<std::string, int>{{"error", 4}}));
  EXPECT_EQ(packets.at(3).received, HostTime(nanoseconds(30'806'898'000)));
  EXPECT_EQ(test::read_can_log(data_file.string(), faults, 5).size(), 1u);
}

TEST(CanLog, OtherBasesFdAndCandump) {
  CanLogParser asc;
  EXPECT_FALSE(asc.take("base dec timestamps relative")->has_value());
  auto entry = asc.take("  1.500000 2  419348235x  Rx   d 2 16 255");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->frame.id, 419348235u);
  EXPECT_TRUE((*entry)->frame.is_extended);
  EXPECT_EQ((*entry)->frame.data[1], 255);
  EXPECT_EQ((*entry)->frame.bus, 2);
  EXPECT_EQ((*asc.take("0.25 1 100 Tx d 0"))->time, nanoseconds(1'750'000'000));
  EXPECT_FALSE(asc.take("0.25 1 100 Rx d 3 1 2").ok());
  CanLogParser fd;
  entry = fd.take(
      "   30.300981 CANFD   3 Tx      50005x 1 0 5 5  b0 6b 20 b1 87 140000 73 200050 7a60 46500250 460a0250 20011736 "
      "20010205");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->frame.id, 0x50005u);
  EXPECT_EQ((*entry)->frame.length, 5);
  EXPECT_EQ((*entry)->frame.data[4], 0x87);
  entry = fd.take("(1436509052.249713) vcan0 044#2A366C2BBA");
  ASSERT_TRUE(entry.ok() && *entry);
  EXPECT_EQ((*entry)->time, nanoseconds(1'436'509'052'249'713'000));
  EXPECT_EQ((*entry)->frame.length, 5);
  EXPECT_TRUE((*fd.take("(1.0) can0 12345678##1AABB"))->frame.is_fd);
  EXPECT_TRUE((*fd.take("(1.0) can0 20000044#0004000000000000"))->frame.is_error);
  EXPECT_TRUE((*fd.take("(1.0) can0 321#R4"))->frame.is_remote);
  for (const char* broken :
       {"(1.0) can0 321#A", "(1.0) can0 FFF#AA", "(x) can0 321#AA", "(1.0) can0 321#AABBCCDDEEFF001122"})
    EXPECT_FALSE(fd.take(broken).ok()) << broken;
}

/// A length code of 9 to 15 in a classic frame means 8 bytes. FD frames may come in the classic form.
TEST(CanLog, LengthCodesBeyondEight) {
  CanLogParser asc;
  auto entry = asc.take(
      "  13.258671 1  3FF             Tx   d D 55 AA 01 02 03 04 05 06  Length = 232016 BitCount = 119 ID = 1023");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->frame.length, 8);
  EXPECT_FALSE((*entry)->frame.is_fd);
  EXPECT_EQ((*entry)->frame.data[7], 6);
  std::string fd = " 0.000000 1  123x            Rx   d 40";
  for (int i = 0; i < 64; ++i) fd += " 2" + std::to_string(i % 10);
  entry = asc.take(fd);
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->frame.length, 64);
  EXPECT_TRUE((*entry)->frame.is_fd);
  EXPECT_FALSE(asc.take(" 0.000000 1  123  Rx   d 40 00 01 02 03 04 05 06 07").ok());
  EXPECT_FALSE(asc.take(" 0.000000 1  123  Rx   d D 00 01 02").ok());
}

/// The output of `candump -t a` for people, with and without the columns of -x.
TEST(CanLog, CandumpForPeople) {
  CanLogParser log;
  auto entry = log.take(" (1436509052.249713)  can0  123   [8]  11 22 33 44 55 66 77 88");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->time, nanoseconds(1'436'509'052'249'713'000));
  EXPECT_EQ((*entry)->frame.id, 0x123u);
  EXPECT_EQ((*entry)->frame.length, 8);
  EXPECT_EQ((*entry)->frame.data[7], 0x88);
  entry = log.take(" (1.5)  can0  TX B -  18FEF100  [12]  11 22 33 44 55 66 77 88 99 AA BB CC");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_TRUE((*entry)->frame.is_extended && (*entry)->frame.is_fd && (*entry)->frame.is_local);
  EXPECT_EQ((*entry)->frame.length, 12);
  EXPECT_EQ((*log.take("(         1.250000) can0 321#11"))->time, nanoseconds(1'250'000'000));  // in columns
  EXPECT_FALSE(log.take("(     ) can0 321#11").ok());
  EXPECT_TRUE((*log.take(" (1.5)  can0  321   [4]  remote request"))->frame.is_remote);
  EXPECT_TRUE((*log.take(" (1.5)  can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME"))->frame.is_error);
  EXPECT_EQ((*log.take(" (1.5)  can0  321   [0]"))->frame.length, 0);
  for (const char* broken :
       {" (1.5)  can0  321", " (1.5)  can0  321   [8]  00", " (1.5)  can0  321   [9]  00 00 00 00 00 00 00 00 00",
        " (1.5)  can0  32   [1]  00", " (1.5)  can0  321   [1  00", " (1.5)  can0  321   [1]  0"})
    EXPECT_FALSE(log.take(broken).ok()) << broken;
}

TEST(CanLog, WhatStandsBehindAFrameOfCandumpIsItsDirection) {
  CanLogParser log;
  EXPECT_FALSE((*log.take("(1.5) can0 321#11 R"))->frame.is_local);
  const auto sent = log.take("(1.5) can0 321#1122 T\r");
  ASSERT_TRUE(sent.ok() && *sent);
  EXPECT_TRUE((*sent)->frame.is_local);
  EXPECT_EQ((*sent)->frame.length, 2);
  for (const char* edited : {"(1.5) can0 321# 11 22", "(1.5) can0 321#11 X", "(1.5) can0 321#11 R T"})
    EXPECT_FALSE(log.take(edited).ok()) << edited;
}

TEST(CanLog, CandumpByDateIsReadAndDifferencesAreRefused) {
  CanLogParser dated;
  auto entry = dated.take(" (2020-04-22 10:21:45.123456)  can0  123   [2]  11 22");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->time, nanoseconds(1'587'550'905'123'456'000));  // date -u -d '2020-04-22 10:21:45' +%s
  EXPECT_EQ((*entry)->interface, "can0");
  EXPECT_EQ((*entry)->frame.data[1], 0x22);
  for (const char* broken : {" (2020-13-22 10:21:45.1)  can0  123   [0]", " (2020-04-22 10:21:61.1)  can0  123   [0]",
                             " (2020-04-22 10:21:45.1  can0  123   [0]"})
    EXPECT_FALSE(dated.take(broken).ok()) << broken;

  const auto frames = [](const std::vector<const char*>& times) {
    CanLogParser log;
    int out = 0;
    for (const char* time : times) out += log.take(std::string(" (") + time + ")  can0  123   [1]  11").ok() ? 1 : 0;
    return out;
  };
  EXPECT_EQ(frames({"000.000000", "000.010000", "000.000200", "000.009900", "000.000100", "000.009000", "000.000300",
                    "000.009000"}),
            6);
  EXPECT_EQ(frames({"000.000000", "000.010000", "000.009999", "000.020000", "000.030000", "000.029999"}), 6)
      << "two interfaces";
  EXPECT_EQ(frames({"12.0", "11.0", "10.0", "9.0", "8.0"}), 5) << "not from the beginning";
}

TEST(CanLog, TablesOfSavvyCanAndPythonCan) {
  CanLogParser savvy;
  ASSERT_FALSE(savvy.take("Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\r")->has_value());
  auto entry = savvy.take("4294967000,0000021A,false,Rx,1,3,FE,36,12,,,,,\r");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->time, std::chrono::microseconds(4'294'967'000));
  EXPECT_EQ((*entry)->frame.id, 0x21Au);
  EXPECT_EQ((*entry)->frame.bus, 1);
  EXPECT_EQ((*entry)->frame.length, 3);
  EXPECT_EQ((*entry)->frame.data[2], 0x12);
  EXPECT_FALSE((*entry)->frame.is_extended || (*entry)->frame.is_local);
  entry = savvy.take("704,18FEF100,true,Tx,0,8,01,02,03,04,05,06,07,08,");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->time, std::chrono::microseconds(4'294'968'000)) << "the counter of 32 bits has started again";
  EXPECT_TRUE((*entry)->frame.is_extended && (*entry)->frame.is_local);
  EXPECT_EQ((*entry)->frame.data[7], 8);
  for (const char* broken :
       {"1,021A,false,Rx,1,4,FE,36,12,,,,,", "1,FFF,false,Rx,1,0,,,,,,,,", "1,1,maybe,Rx,1,0,,", "x,1,false,Rx,1,0,,",
        "1,1,false,Rx,1,65,,", "1,1,false,Rx,1,1,123,", "1,1,false,Rx,,0,,", "1,1,false"})
    EXPECT_FALSE(savvy.take(broken).ok()) << broken;

  CanLogParser python;
  ASSERT_FALSE(python.take("timestamp,arbitration_id,extended,remote,error,dlc,data")->has_value());
  entry = python.take("1483389946.197,0x123,0,0,0,8,ESIzRFVmd4g=");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->time, nanoseconds(1'483'389'946'197'000'000));
  EXPECT_EQ((*entry)->frame.length, 8);
  const decltype(CanFrame::data) sent{0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88};
  EXPECT_EQ((*entry)->frame.data, sent);
  EXPECT_EQ((*python.take("1.5,0x18fef100,1,0,0,2,//8="))->frame.data[1], 0xFF);
  EXPECT_TRUE((*python.take("1.5,0x123,0,1,0,4,"))->frame.is_remote);
  EXPECT_TRUE((*python.take("1.5,0x4,0,0,1,0,"))->frame.is_error);
  EXPECT_EQ((*python.take("1.5,0x123,0,0,0,0,"))->frame.length, 0);
  for (const char* broken : {"1.5,0x123,0,0,0,8,ESIz", "1.5,0x123,0,0,0,3,E!Iz", "1.5,0x123,0,0,0,1,E"})
    EXPECT_FALSE(python.take(broken).ok()) << broken;
  for (const char* other : {"x,y,z", "timestamp,id,data", "date Mon, Jan 1"})
    EXPECT_FALSE(CanLogTable::is_head(other)) << other;
}

TEST(CanLog, LogsOfBusmaster) {
  CanLogParser log;
  for (const char* head : {"***BUSMASTER Ver 3.2.2***", "***PROTOCOL CAN***", "***HEX***", "***SYSTEM MODE***",
                           "***<Time><Tx/Rx><Channel><CAN ID><Type><DLC><DataBytes>***"})
    ASSERT_FALSE(log.take(head)->has_value()) << head;
  auto entry = log.take("23:59:59:9420 Rx 1 0x023 s 2 40 FF");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->time, std::chrono::milliseconds(86'399'942));
  EXPECT_EQ((*entry)->frame.id, 0x23u);
  EXPECT_EQ((*entry)->frame.bus, 1);
  EXPECT_EQ((*entry)->frame.length, 2);
  EXPECT_EQ((*entry)->frame.data[1], 0xFF);
  entry = log.take("00:00:00:0010 Tx 2 0x18FEF100 x 1 7F");
  ASSERT_TRUE(entry.ok() && *entry) << entry.error().message;
  EXPECT_EQ((*entry)->time, std::chrono::microseconds(86'400'001'000)) << "behind midnight";
  EXPECT_TRUE((*entry)->frame.is_extended && (*entry)->frame.is_local);
  EXPECT_TRUE((*log.take("00:00:00:0020 Rx 1 0x023 sr 4"))->frame.is_remote);
  for (const char* broken : {"00:00:00 Rx 1 0x023 s 0", "00:00:00:0020 Rx 1 0x023 s 2 40", "00:00:00:0020 Rx 1 023",
                             "00:00:00:0020 Rx 1 0x023 q 0", "00:00:00:0020 Rx 1 0x823 s 0"})
    EXPECT_FALSE(log.take(broken).ok()) << broken;
  EXPECT_FALSE(log.take("***END DATE AND TIME 19:10:2018 16:51:16:443***")->has_value());

  CanLogParser relative;
  for (const char* head : {"***BUSMASTER Ver 3.2.2***", "***DEC***", "***RELATIVE MODE***"})
    ASSERT_FALSE(relative.take(head)->has_value());
  EXPECT_EQ((*relative.take("00:00:01:5000 Rx 1 100 s 1 255"))->frame.data[0], 255);
  EXPECT_EQ((*relative.take("00:00:00:2500 Rx 1 100 s 0"))->time, std::chrono::milliseconds(1750));
  CanLogParser lin;
  for (const char* head : {"***BUSMASTER Ver 2.0.0***", "***PROTOCOL LIN***"})
    ASSERT_FALSE(lin.take(head)->has_value());
  EXPECT_FALSE(lin.take("00:00:01:5000 Rx 1 0x10 s 1 FF").ok());
}

/// The rows of PEAK's traces in each version. A row without a frame is a warning, a status or an event.
TEST(CanLog, TracesOfPeak) {
  struct Version {
    std::vector<std::string> head;
    std::string frame, extended, remote, error, none;
  };
  const std::vector<Version> versions = {{{},
                                          "     1)     17535  0123  3  0A 0B 0C",
                                          "2) 17535 18FEF100 1 7F",
                                          "3) 17535 0123 4 RTR",
                                          "",
                                          "4) 17540 FFFFFFFF  4  00 00 00 08 -- -- -- -- BUSHEAVY"},
                                         {{";$FILEVERSION=1.0"},
                                          "     1)     17535  0123  3  0A 0B 0C",
                                          "2) 17535 18FEF100 1 7F",
                                          "3) 17535 0123 4 RTR",
                                          "",
                                          "4) 17540 FFFFFFFF  4  00 00 00 08 -- -- -- -- BUSHEAVY"},
                                         {{";$FILEVERSION=1.1\r", ";$STARTTIME=44548.6"},
                                          "     1)     17535.4  Rx         0123  3  0A 0B 0C \r",
                                          "2) 17535.4 Tx 18FEF100 1 7F",
                                          "3) 17535.4 Rx 0123 4 RTR",
                                          "5) 17540.3 Error 0008 4 00 02 00 00",
                                          "4) 17540.3  Warng  FFFFFFFF  4  00 00 00 08  BUSHEAVY"},
                                         {{";$FILEVERSION=1.3"},
                                          "     1)     17535.400 2  Rx    0123 -  3    0A 0B 0C",
                                          "2) 17535.4 2 Tx 18FEF100 - 1 7F",
                                          "3) 17535.4 2 Rx 0123 - 4 RTR",
                                          "5) 17540.3 2 Error 0008 - 4 00 02 00 00",
                                          "4) 17540.3 2 Warng  FFFFFFFF - 4  00 00 00 08  BUSHEAVY"},
                                         {{";$FILEVERSION=2.0", ";$COLUMNS=N,O,T,I,d,l,D"},
                                          "      1     17535.400 DT     0123 Rx 3  0A 0B 0C",
                                          "2 17535.4 DT 18FEF100 Tx 1 7F",
                                          "3 17535.4 RR 0123 Rx 4",
                                          "5 17540.3 ER Rx 04 00 02 00 00",
                                          "      4     17540.300 ST          Rx    00 00 00 08"},
                                         {{";$FILEVERSION=2.1", ";$COLUMNS=N,O,T,B,I,d,R,L,D"},
                                          "      1     17535.400 DT 2      0123 Rx -  3    0A 0B 0C",
                                          "2 17535.4 DT 2 18FEF100 Tx - 1 7F",
                                          "3 17535.4 RR 2 0123 Rx - 4",
                                          "5 17540.3 ER 2 - Rx - 5 04 00 02 00 00",
                                          "4 17540.3 EV 2 User-defined event 4"}};
  for (const Version& version : versions) {
    CanLogParser log;
    for (const std::string& line : version.head) EXPECT_FALSE(log.take(line)->has_value());
    auto entry = log.take(version.frame);
    ASSERT_TRUE(entry.ok() && *entry) << version.frame;
    EXPECT_EQ((*entry)->time.count() / 100'000'000, 175);
    EXPECT_EQ((*entry)->frame.id, 0x123u);
    EXPECT_EQ((*entry)->frame.length, 3);
    EXPECT_EQ((*entry)->frame.data[2], 0x0C);
    EXPECT_FALSE((*entry)->frame.is_extended || (*entry)->frame.is_local || (*entry)->frame.is_remote);
    EXPECT_EQ((*entry)->frame.bus, version.frame.find(" 2 ") == std::string::npos ? 0 : 2);
    entry = log.take(version.extended);
    ASSERT_TRUE(entry.ok() && *entry) << version.extended;
    EXPECT_TRUE((*entry)->frame.is_extended);
    EXPECT_EQ((*entry)->frame.is_local, version.extended.find(" Tx ") != std::string::npos)
        << "version 1.0 does not say who sent it";
    EXPECT_EQ((*entry)->frame.id, 0x18FEF100u);
    EXPECT_EQ((*entry)->frame.length, 1);
    EXPECT_TRUE((*log.take(version.remote))->frame.is_remote) << version.remote;
    if (!version.error.empty()) {
      EXPECT_TRUE((*log.take(version.error))->frame.is_error) << version.error;
    }
    EXPECT_FALSE(log.take(version.none)->has_value()) << version.none;
    EXPECT_FALSE(log.take(version.frame.substr(0, version.frame.find("0C"))).ok()) << "cut";
    EXPECT_FALSE(log.take("7) 1x7").ok());
  }
  CanLogParser fd;
  EXPECT_FALSE(fd.take(";$FILEVERSION=2.1")->has_value());
  EXPECT_FALSE(fd.take(";$COLUMNS=N,O,T,I,d,L,D")->has_value());
  const auto entry = fd.take("1 0.25 FB 0123 Rx 9 00 01 02 03 04 05 06 07 08 09 0A 0B");
  ASSERT_TRUE(entry.ok() && *entry);
  EXPECT_EQ((*entry)->time, nanoseconds(250'000));
  EXPECT_TRUE((*entry)->frame.is_fd);
  EXPECT_EQ((*entry)->frame.length, 12);
  EXPECT_FALSE(fd.take("1 0.25 DT 0123 Rx 16 00").ok());
}

/// What PEAK-Converter makes of a trace: the names of the columns stand behind a glossary.
TEST(CanLog, TracesThatPeakConverterHasWritten) {
  CanLogParser log;
  for (const char* head : {"$STARTTIME=45628.8611853472", "", "    Generated by PEAK-Converter Version 3.0.3.557",
                           "     DT: CAN or J1939 data frame", "-------",
                           "Number Time (ms) Bus Direction Type ID (hex) Reserved Length D0 D1 D2 D3 D... "}) {
    const auto none = log.take(head);
    EXPECT_TRUE(none.ok() && !*none) << head;
  }
  const auto entry = log.take("12 2400.100 2 Tx DT 18FEBF0B - 3 00 01 FF\r");
  ASSERT_TRUE(entry.ok() && *entry);
  EXPECT_EQ((*entry)->time, nanoseconds(2'400'100'000));
  const CanFrame& frame = (*entry)->frame;
  EXPECT_EQ(name(frame), "18FEBF0B");
  EXPECT_TRUE(frame.is_local);
  EXPECT_EQ(frame.bus, 2);
  EXPECT_EQ(frame.length, 3);
  EXPECT_EQ(frame.data[2], 0xFF);
  EXPECT_FALSE((*log.take("13 2400.200 1 Rx FB 0321 - 12 00 01 02 03 04 05 06 07 08 09 0A 0B"))->frame.is_local);
  EXPECT_FALSE(log.take("14 2400.300 1 Rx ST - - 4 00 00 00 08")->has_value());
}

/// Lines of `candump can0`, and where a log of candump begins.
TEST(CanLog, FramesOfCandumpWithoutATimeAreRefused) {
  EXPECT_FALSE(CanLogParser().take("  can0  09F8017F   [8]  E8 AC 51 19 BE AB 6D D5").ok());
  EXPECT_FALSE(CanLogParser().take("  can0  RX - -  43F   [2]  1A 7F   '..'").ok());
  EXPECT_TRUE(CanLogParser().take("# can0 with a [note]").ok());
  for (const char* log : {"(1.0) can0 321#11", " (1.0)  can0  321   [1]  11", "\n(1.0) can0 321#11",
                          "# a note\r\n\r\n(1.0) can0 321#11", "  can0  321   [0]", "  can0  TX - -  321   [1]  11"})
    EXPECT_TRUE(is_candump(log)) << log;
  for (const char* other : {"", "\n\n", "# a note", "(a) text\n", "base hex", "can0 is [not] a log"})
    EXPECT_FALSE(is_candump(other)) << other;
}

/// As `candump -L any` writes it. An id means something else on each bus.
TEST(CanLog, TheInterfacesOfALogOfCandumpAreToldApart) {
  const auto path = std::filesystem::temp_directory_path() / ("hueline_can_buses_" + std::to_string(::getpid()));
  std::ofstream(path) << "(1.0) can0 321#AA\n(2.0) can1 321#BB\n(3.0) can0 321#CC\n(4.0) can1 321#DD\n";
  const auto read = [&](const std::string& interface) {
    CanLogSource source({.path = path.string(), .interface = interface});
    std::string bytes;
    std::size_t told = 0;
    EXPECT_TRUE(source.open().ok());
    for (Result<Packet> packet = source.next({}); packet.ok(); packet = source.next({})) {
      CanPacket parsed;
      if (packet->kind == PacketKind::Fault)
        told += decode_fault(1, packet->received, packet->bytes.bytes())->kind == FaultKind::WrongDevice ? 1 : 0;
      else if (decode_can_packet(packet->bytes.bytes(), parsed).ok())
        bytes += fmt::format("{} {:02X} ", source.interface(), parsed.frames.front().data[0]);
    }
    return std::pair(bytes, told);
  };
  EXPECT_EQ(read(""), std::pair(std::string("can0 AA can1 BB can0 CC can1 DD "), std::size_t{1}));
  EXPECT_EQ(read("can1"), std::pair(std::string("can1 BB can1 DD "), std::size_t{0}));
  std::filesystem::remove(path);
}

TEST(CanLog, BrokenLinesAreCountedAtTheEnd) {
  const auto path = std::filesystem::temp_directory_path() / ("hueline_can_log_" + std::to_string(::getpid()));
  std::ofstream(path) << "(1.0) can0 321#AA\n(2.0) can0 321#A\n(3.0) can0 32#AA\n(4.0) can0 321#BB\n(5.0) can0 321#CC "
                      << std::string(100'000, 'x') << "\n(6.0) can0 321#DD";
  std::vector<Fault> faults;
  EXPECT_EQ(test::read_can_log(path.string(), faults).size(), 3u);
  std::filesystem::remove(path);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].count, 3u) << "also the line that is no line";
  EXPECT_NE(faults[0].detail.find("line 2"), std::string::npos) << faults[0].detail;
  CanLogSource missing({"/no/such/file.asc", 0});
  EXPECT_FALSE(missing.open().ok());
}

}  // namespace
}  // namespace hueline::drivers
