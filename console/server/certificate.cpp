#include "console/server/certificate.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <utility>

namespace hueline::console {
namespace {

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* one) const {
    Free(one);
  }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using File = std::unique_ptr<std::FILE, Freed<std::fclose>>;

bool add_extension(X509* certificate, int what, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, what, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

Certificate sign(EVP_PKEY* key) {
  std::array<char, 64> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  Certificate out(X509_new());
  std::array<unsigned char, 16> serial{};
  if (!out || RAND_bytes(serial.data(), serial.size()) != 1) return {};
  serial[0] &= 0x7f;
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number(BN_bin2bn(serial.data(), serial.size(), nullptr));
  constexpr long kTenYears = 10L * 365 * 24 * 3600;
  X509_NAME* const subject = X509_get_subject_name(out.get());
  const bool done =
      number && X509_set_version(out.get(), 2) == 1 &&
      BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(out.get())) != nullptr &&
      X509_gmtime_adj(X509_getm_notBefore(out.get()), -3600) != nullptr &&
      X509_gmtime_adj(X509_getm_notAfter(out.get()), kTenYears) != nullptr && X509_set_pubkey(out.get(), key) == 1 &&
      X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("hueline console"),
                                 -1, -1, 0) == 1 &&
      X509_set_issuer_name(out.get(), subject) == 1 &&
      add_extension(out.get(), NID_basic_constraints, "critical,CA:FALSE") &&
      add_extension(out.get(), NID_subject_alt_name,
                    fmt::format("DNS:localhost,IP:127.0.0.1,IP:::1{}{}", host[0] ? ",DNS:" : "", host.data())) &&
      X509_sign(out.get(), key, EVP_sha256()) > 0;
  return done ? std::move(out) : Certificate();
}

}  // namespace

Status make_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key) {
  std::error_code ignored;
  if (std::filesystem::exists(certificate, ignored) && std::filesystem::exists(key, ignored)) return {};
  const Key made(EVP_EC_gen("P-256"));
  const Certificate signed_one = made ? sign(made.get()) : Certificate();
  if (!signed_one) return Error{ErrorCode::Io, "a certificate cannot be made: OpenSSL refuses"};
  const int fd = ::open(key.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  const File key_file(fd < 0 ? nullptr : ::fdopen(fd, "w"));
  if (!key_file) return io_error(key.string() + " cannot be written", errno);
  const File certificate_file(std::fopen(certificate.c_str(), "we"));
  if (!certificate_file) return io_error(certificate.string() + " cannot be written", errno);
  if (PEM_write_PrivateKey(key_file.get(), made.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1 ||
      PEM_write_X509(certificate_file.get(), signed_one.get()) != 1 || std::fflush(key_file.get()) != 0 ||
      std::fflush(certificate_file.get()) != 0)
    return io_error(certificate.string() + " cannot be written", errno);
  return {};
}

Result<std::string> fingerprint(const std::filesystem::path& certificate) {
  const File file(std::fopen(certificate.c_str(), "re"));
  if (!file) return io_error(certificate.string() + " cannot be read", errno);
  const Certificate read(PEM_read_X509(file.get(), nullptr, nullptr, nullptr));
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (!read || X509_digest(read.get(), EVP_sha256(), digest.data(), &size) != 1)
    return Error{ErrorCode::Malformed, certificate.string() + " is no certificate (PEM)"};
  std::string out;
  for (unsigned i = 0; i < size; ++i) out += fmt::format("{}{:02X}", i ? ":" : "", digest[i]);
  return out;
}

Result<boost::asio::ssl::context> tls_context(const std::filesystem::path& certificate,
                                              const std::filesystem::path& key) {
  namespace ssl = boost::asio::ssl;
  ssl::context context(ssl::context::tls_server);
  boost::system::error_code failed;
  context.set_options(ssl::context::default_workarounds | ssl::context::no_sslv2 | ssl::context::no_sslv3 |
                          ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1,
                      failed);
  const auto wrong = [&](const std::filesystem::path& file) {
    return Error{ErrorCode::Io, fmt::format("{}: {}", file.string(), failed.message())};
  };
  context.use_certificate_chain_file(certificate.string(), failed);
  if (failed) return wrong(certificate);
  context.use_private_key_file(key.string(), ssl::context::pem, failed);
  if (failed) return wrong(key);
  return context;
}

}  // namespace hueline::console
