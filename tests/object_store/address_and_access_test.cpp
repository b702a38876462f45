#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "object_store/s3_access.hpp"
#include "object_store/s3_address.hpp"
#include "object_store/s3_client.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::object_store {
namespace {

TEST(S3Address, HasABucketAndAKey) {
  const auto address = S3Address::parse("s3://drives/2026/november 3/drive.mcap");
  ASSERT_TRUE(address.ok());
  EXPECT_EQ(address->bucket, "drives");
  EXPECT_EQ(address->key, "2026/november 3/drive.mcap");
  EXPECT_EQ(name(*address), "s3://drives/2026/november 3/drive.mcap");
  EXPECT_EQ(S3Address::parse("s3://drives")->key, "");
  EXPECT_EQ(S3Address::parse("s3://drives/")->key, "");
}

TEST(S3Address, IsRefusedWithWhatIsWrong) {
  EXPECT_NE(S3Address::parse("s3://").error().message.find("names no bucket"), std::string::npos);
  EXPECT_NE(S3Address::parse("s3:///key").error().message.find("names no bucket"), std::string::npos);
  // It would become a part of the server's name.
  EXPECT_EQ(S3Address::parse("s3://evil@host/key").error().code, ErrorCode::Invalid);
  EXPECT_EQ(S3Address::parse("http://drives/key").error().code, ErrorCode::Invalid);
}

TEST(S3Xml, GivesTextsWithoutEntities) {
  const std::string xml = "<a><Key>one &amp; two</Key><Key>&lt;&#39;&#x41;</Key><Key>cut";
  std::size_t at = 0;
  EXPECT_EQ(xml_text(xml, "Key", at), "one & two");
  EXPECT_EQ(xml_text(xml, "Key", at), "<'A");
  EXPECT_EQ(xml_text(xml, "Key", at), std::nullopt);
}

class S3AccessTest : public testing::Test {
 protected:
  Result<S3Access> read() {
    variables_.emplace("HOME", home_.path().string());
    return S3Access::read([this](const char* name) -> std::optional<std::string> {
      const auto found = variables_.find(name);
      if (found == variables_.end()) return {};
      return found->second;
    });
  }
  void write(const char* file, const std::string& text) {
    std::filesystem::create_directories(home_.path() / ".aws");
    std::ofstream(home_.path() / ".aws" / file) << text;
  }

  test::TemporaryFolder home_;
  std::map<std::string, std::string> variables_;
};

TEST_F(S3AccessTest, IsAnonymousWithoutAnything) {
  const auto access = read();
  ASSERT_TRUE(access.ok());
  EXPECT_TRUE(access->is_anonymous());
  EXPECT_EQ(access->region, "us-east-1");
  EXPECT_EQ(access->endpoint, "");
}

TEST_F(S3AccessTest, ReadsTheEnvironmentFirst) {
  write("credentials", "[default]\naws_access_key_id = FILE\naws_secret_access_key = file\n");
  variables_ = {{"AWS_ACCESS_KEY_ID", "KEY"},
                {"AWS_SECRET_ACCESS_KEY", "secret"},
                {"AWS_SESSION_TOKEN", "token"},
                {"AWS_DEFAULT_REGION", "eu-west-1"},
                {"AWS_ENDPOINT_URL", "http://other:9000"},
                {"AWS_ENDPOINT_URL_S3", "http://storage:9000/"}};
  const auto access = read();
  ASSERT_TRUE(access.ok());
  EXPECT_EQ(access->key_id + access->secret + access->token, "KEYsecrettoken");
  EXPECT_EQ(access->region, "eu-west-1");
  EXPECT_EQ(access->endpoint, "http://storage:9000");
}

TEST_F(S3AccessTest, ReadsTheProfileOfBothFiles) {
  write("credentials",
        "# a remark\n[default]\naws_access_key_id=OTHER\naws_secret_access_key=other\n"
        "[survey]\n  aws_access_key_id = INDENTED\naws_access_key_id = KEY\naws_secret_access_key = se=cret/+\n");
  write("config", "[profile survey]\nregion = eu-central-1\nendpoint_url = https://storage\ns3 =\n  region = wrong\n");
  variables_ = {{"AWS_PROFILE", "survey"}};
  const auto access = read();
  ASSERT_TRUE(access.ok());
  EXPECT_EQ(access->key_id, "KEY");
  EXPECT_EQ(access->secret, "se=cret/+");
  EXPECT_EQ(access->region, "eu-central-1");
  EXPECT_EQ(access->endpoint, "https://storage");
  EXPECT_NE(access->from.find("the profile \"survey\" of "), std::string::npos);
}

TEST_F(S3AccessTest, RefusesHalvesAndStrangers) {
  variables_ = {{"AWS_ACCESS_KEY_ID", "KEY"}};
  EXPECT_EQ(read().error().code, ErrorCode::Invalid);
  variables_ = {{"AWS_PROFILE", "nobody"}};
  EXPECT_NE(read().error().message.find("AWS_PROFILE is \"nobody\""), std::string::npos);
  variables_ = {{"AWS_ENDPOINT_URL", "storage:9000"}};
  EXPECT_NE(read().error().message.find("http:// or https://"), std::string::npos);
  write("config", "[default]\nsso_session = office\n");
  variables_.clear();
  EXPECT_EQ(read().error().code, ErrorCode::Unsupported);
  write("config", "");
  write("credentials", "[default]\naws_access_key_id = KEY\n");
  const auto half = read();
  EXPECT_EQ(half.error().code, ErrorCode::Invalid);
}

}  // namespace
}  // namespace hueline::object_store
