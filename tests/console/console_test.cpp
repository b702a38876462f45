#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <thread>

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
