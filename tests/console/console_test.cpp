#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "console/server/api.hpp"
#include "console/server/drive_control.hpp"
#include "console/server/foxglove_client.hpp"
#include "console/server/places.hpp"
#include "console/server/sessions.hpp"
#include "console/server/users.hpp"
#include "core/child.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::console {
namespace {

using test::TemporaryFolder;
using namespace std::chrono_literals;

TEST(Users, ArePassedByTheirPasswordOnly) {
  const TemporaryFolder folder;
  const auto file = folder / "users.json";
  Users users;
  ASSERT_TRUE(users.add("anna", Role::Operator, "correct horse").ok());
  ASSERT_TRUE(users.add("bert", Role::Viewer, "battery staple").ok());
  ASSERT_TRUE(users.save(file).ok());
  struct stat file_state {};
  ASSERT_EQ(::stat(file.c_str(), &file_state), 0);
  EXPECT_EQ(file_state.st_mode & 0777, 0600u);
  EXPECT_EQ(test::contents(file).find("correct horse"), std::string::npos);
  EXPECT_NE(test::contents(file).find("$argon2id$"), std::string::npos);

  const auto again = Users::load(file);
  ASSERT_TRUE(again.ok());
  const User* anna = again->check("anna", "correct horse");
  ASSERT_NE(anna, nullptr);
  EXPECT_EQ(anna->role, Role::Operator);
  EXPECT_EQ(again->check("anna", "battery staple"), nullptr);
  EXPECT_EQ(again->check("anna", ""), nullptr);
  EXPECT_EQ(again->check("nobody", "correct horse"), nullptr);
  EXPECT_EQ(again->check("bert", "battery staple")->role, Role::Viewer);
}

TEST(Users, HaveATokenForOtherPrograms) {
  Users users;
  ASSERT_TRUE(users.add("anna", Role::Viewer, "correct horse").ok());
  const auto token = users.make_token("anna");
  ASSERT_TRUE(token.ok());
  EXPECT_EQ(token->size(), 64u);
  EXPECT_EQ(users.of_token(*token)->name, "anna");
  std::string wrong = *token;
  wrong[63] = wrong[63] == '0' ? '1' : '0';
  EXPECT_EQ(users.of_token(wrong), nullptr);
  EXPECT_EQ(users.of_token(""), nullptr);
  EXPECT_EQ(users.make_token("nobody").error().code, ErrorCode::Invalid);
}

TEST(Users, CanBeRemoved) {
  Users users;
  ASSERT_TRUE(users.add("anna", Role::Operator, "correct horse").ok());
  ASSERT_TRUE(users.add("bert", Role::Viewer, "battery staple").ok());
  const auto token = users.make_token("anna");
  ASSERT_TRUE(users.remove("anna").ok());
  EXPECT_EQ(users.find("anna"), nullptr);
  EXPECT_EQ(users.check("anna", "correct horse"), nullptr);
  EXPECT_EQ(users.of_token(*token), nullptr);
  EXPECT_NE(users.find("bert"), nullptr);
  EXPECT_EQ(users.remove("anna").error().code, ErrorCode::Invalid);
}

TEST(Places, ShowWhateverNamePeopleGiveToADrive) {
  const TemporaryFolder folder;
  const Places places{folder.path(), {}, folder.path(), {}};
  for (const char* name : {"Hauptstraße 1", "it's \"x\" <b>", "plain", ".hidden", "a\nb"}) {
    std::filesystem::create_directory(folder / name);
    std::ofstream(folder / name / "drive.mcap") << "x";
    std::ofstream(folder / (std::string(name) + ".yaml")) << "x";
  }
  const auto found = places.drives_json({});
  std::set<std::string> names;
  for (const auto& one : found["drives"]) names.insert(one["name"].get<std::string>());
  EXPECT_EQ(names, (std::set<std::string>{"Hauptstraße 1", "it's \"x\" <b>", "plain"}));
  EXPECT_EQ(found["all"], 3);
  EXPECT_TRUE(places.file_of("Hauptstraße 1", "drive.mcap").ok());
  EXPECT_TRUE(places.rig_path("Hauptstraße 1").ok());
  for (const char* name : {"", ".", "..", "../x", ".hidden", "a\nb", "plain/../plain"})
    EXPECT_FALSE(places.file_of(name, "drive.mcap").ok()) << name;
}

TEST(Users, RefuseWhatIsNoNameNoPasswordAndNoFile) {
  Users users;
  for (const char* name : {"", "../x", "a b", ".hidden", "-x", "ä"})
    EXPECT_EQ(users.add(name, Role::Viewer, "long enough").error().code, ErrorCode::Invalid) << name;
  EXPECT_FALSE(users.add("anna", Role::Viewer, "short").ok());
  EXPECT_FALSE(users.add("anna", Role::Viewer, std::string(257, 'x')).ok());
  const TemporaryFolder folder;
  for (const char* text :
       {"", "[]", "{}", R"({"users":[{}]})", R"({"users":[{"name":"a","role":"king","password":"x"}]})"}) {
    std::ofstream(folder / "users.json") << text;
    EXPECT_EQ(Users::load(folder / "users.json").error().code, ErrorCode::Malformed) << text;
  }
}

TEST(Sessions, EndWhenNobodyUsesThem) {
  Sessions sessions;
  const auto begin = Sessions::Clock::now();
  const std::string secret = sessions.begin({"anna", Role::Operator, {}, {}}, begin);
  ASSERT_NE(sessions.find(secret, begin + 11h), nullptr);
  EXPECT_NE(sessions.find(secret, begin + 22h), nullptr) << "it was used in between";
  EXPECT_EQ(sessions.find(secret, begin + 35h), nullptr);
  EXPECT_EQ(sessions.find("", begin), nullptr);
  for (int i = 0; i < 1000; ++i) (void)sessions.begin({"bert", Role::Viewer, {}, {}}, begin + i * 1s);
  const std::string last = sessions.begin({"anna", Role::Operator, {}, {}}, begin + 2000s);
  sessions.end(last);
  EXPECT_EQ(sessions.find(last, begin + 2001s), nullptr);
}

TEST(Api, AWebSocketEndsWithItsUser) {
  boost::asio::io_context io;
  const TemporaryFolder folder;
  const auto file = folder / "users.json";
  Users users;
  ASSERT_TRUE(users.add("anna", Role::Operator, "correct horse").ok());
  ASSERT_TRUE(users.add("bert", Role::Viewer, "battery staple").ok());
  const auto token = users.make_token("anna");
  ASSERT_TRUE(users.save(file).ok());
  DriveControl drive(io, Places{folder.path(), {}, {}, {}});
  Api api(drive, folder.path(), file, {});
  Request login{"POST", "/api/login", "", {{"content-type", "application/json"}}, "", "10.0.0.1"};
  login.body = R"({"name": "anna", "password": "correct horse"})";
  Answer logged_in;
  api.answer(login, [&](Answer answer) { logged_in = std::move(answer); });
  ASSERT_EQ(logged_in.status, 200u) << logged_in.body;
  const std::string cookie = logged_in.headers["Set-Cookie"];
  EXPECT_NE(cookie.find("; Max-Age=34560000"), std::string::npos) << "it must not end before the session: " << cookie;
  const Request page{"GET", "/ws", "", {{"cookie", cookie.substr(0, cookie.find(';'))}}, "", "10.0.0.1"};
  const Request program{"GET", "/", "token=" + *token, {}, "", "10.0.0.1"};
  Answer refusal;
  for (const Request& opened : {page, program}) {
    ASSERT_TRUE(api.client_of_socket(opened, refusal)) << refusal.body;
    EXPECT_TRUE(api.may_keep_socket(opened));
  }
  const auto before = std::filesystem::last_write_time(file);
  ASSERT_TRUE(users.remove("anna").ok());
  ASSERT_TRUE(users.save(file).ok());
  std::filesystem::last_write_time(file, before + 1s);
  for (const Request& opened : {page, program}) EXPECT_FALSE(api.may_keep_socket(opened));
}

TEST(LoginLimit, LetsFiveWrongPasswordsAMinuteThrough) {
  LoginLimit limit;
  const auto begin = LoginLimit::Clock::now();
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(limit.wait_s("10.0.0.1", begin), 0);
    limit.note_failure("10.0.0.1", begin + i * 1s);
  }
  EXPECT_NEAR(limit.wait_s("10.0.0.1", begin + 10s), 50, 1);
  EXPECT_EQ(limit.wait_s("10.0.0.2", begin + 10s), 0);
  EXPECT_EQ(limit.wait_s("10.0.0.1", begin + 61s), 0);
  for (int i = 0; i < 30; ++i) limit.note_failure("10.0.1." + std::to_string(i), begin + 70s);
  EXPECT_GT(limit.wait_s("10.0.0.9", begin + 71s), 50) << "all addresses together";
}

/// Takes messages, and counts them.
struct CountingWire : Wire {
  void write(std::string, bool) override { ++written; }
  void close(const std::string&) override {}
  int written = 0;
};

TEST(FoxgloveClient, KeepsNoMoreForOneThatSubscribesAgainAndAgainThanItMayTake) {
  boost::asio::io_context io;
  const TemporaryFolder folder;
  const DriveControl drive(io, Places{folder.path(), {}, {}, {}});
  CountingWire wire;
  const auto client = std::make_shared<FoxgloveClient>(io, drive, wire);
  client->begin();
  std::string list;
  for (int id = 0; id < 900; ++id) list += fmt::format("{}{{\"id\":{},\"channelId\":1}}", id > 0 ? "," : "", id);
  for (int i = 0; i < 10; ++i) client->take(fmt::format(R"({{"op":"subscribe","subscriptions":[{}]}})", list));
  for (int before = -1; before < wire.written;) {
    before = wire.written;
    client->written();
  }
  EXPECT_GE(wire.written, 900);
  EXPECT_LT(wire.written, 1100);
  client->end();
}

TEST(Child, SaysWhichFileCannotBeWritten) {
  const TemporaryFolder folder;
  const std::string said = folder / "missing" / "said";
  const auto child = Child::start({"/bin/true"}, said);
  ASSERT_FALSE(child.ok());
  EXPECT_EQ(child.error().message, said + " cannot be written: No such file or directory");
}

TEST(Child, RunsInASessionOfItsOwnWithoutAShell) {
  const TemporaryFolder folder;
  auto child = Child::start({"/bin/sh", "-c", "ps -o sid= -p $$; echo \"$1\"; exit 7", "sh", "$(touch x); `id`"},
                            folder / "said");
  ASSERT_TRUE(child.ok());
  const pid_t pid = child->pid();
  std::optional<int> end;
  for (int i = 0; i < 500 && !(end = child->take_end()); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(end, 7);
  EXPECT_FALSE(child->take_end());
  const std::string said = last_lines(folder / "said", 1000);
  EXPECT_NE(said.find(std::to_string(pid)), std::string::npos) << said;
  EXPECT_NE(said.find("$(touch x); `id`"), std::string::npos) << "the word came as it is: " << said;
  EXPECT_FALSE(Child::start({"/nowhere/hueline"}, folder / "said").ok());
}

TEST(Child, GetsNoneOfTheFilesOfItsParent) {
  const TemporaryFolder folder;
  const int open_here = ::fcntl(STDERR_FILENO, F_DUPFD, 50);
  ASSERT_GE(open_here, 50);
  auto child = Child::start({"/bin/sh", "-c", "ls /proc/$$/fd; echo end"}, folder / "said");
  ::close(open_here);
  ASSERT_TRUE(child.ok());
  std::optional<int> end;
  for (int i = 0; i < 500 && !(end = child->take_end()); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(end, 0);
  const std::string said = test::contents(folder / "said");
  EXPECT_NE(said.find("end"), std::string::npos) << said;
  EXPECT_EQ(said.find(std::to_string(open_here)), std::string::npos) << said;
}

}  // namespace
}  // namespace hueline::console
