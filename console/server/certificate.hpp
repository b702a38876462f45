#pragma once

#include <boost/asio/ssl/context.hpp>
#include <filesystem>
#include <string>

#include "core/result.hpp"

namespace hueline::console {

/// Makes a key (EC P-256) and a certificate that it signs itself, valid for ten years, for this computer's name and
/// localhost, unless both files are there. The key can be read by its owner only. Error: Io.
Status make_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key);

/// Returns the SHA-256 of a certificate as browsers show it, to be compared by people. Error: Io.
Result<std::string> fingerprint(const std::filesystem::path& certificate);

/// Returns what TLS needs, for TLS 1.2 and newer. Error: Io, if a file is missing or they do not fit.
Result<boost::asio::ssl::context> tls_context(const std::filesystem::path& certificate,
                                              const std::filesystem::path& key);

}  // namespace hueline::console
