#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

/// What a replay is expected to give, in a file that people commit beside their tests (docs/formats.md):
///   {"sha256": {"cloud.las": "..."}, "summary": {"/verdict/grade": "good", "/points/total": {"least": 1, "most": 9}}}
/// The keys of `summary` are JSON pointers (RFC 6901) into summary.json. Each value is the one expected, or its bounds.
namespace hueline::apps {

/// One line of an expectation, and what came of it.
struct Expected {
  std::string name;     ///< "sha256 cloud.las" or "summary /points/total"
  std::string problem;  ///< what moved: expected and found; empty if it is as expected
};

/// Returns what is wrong with an expectation, before the products are made. Errors: as compare_with_expectation().
Status check_expectation(const std::filesystem::path& file);

/// Compares the products in `folder` with the expectation. Errors: Invalid if `file` is no expectation, with what is
/// allowed; Io if it cannot be read. A product that is missing is a problem, not an error.
Result<std::vector<Expected>> compare_with_expectation(const std::filesystem::path& file,
                                                       const std::filesystem::path& folder);

/// Writes the expectation that the products in `folder` fulfil: the hashes of cloud and view, the verdict, and the
/// numbers of packets and points. People loosen it to bounds where they want to. Errors: Io.
Status write_expectation(const std::filesystem::path& file, const std::filesystem::path& folder);

/// Returns the results in the form that the test reports of CI systems have (JUnit's XML), one test case a line.
std::string junit_of(const std::vector<Expected>& results, const std::string& recording);

}  // namespace hueline::apps
