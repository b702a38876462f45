// main() of a fuzz target where libFuzzer is not used: a seeded mutator over a corpus of real recordings. The same seed
// and corpus give the same inputs on every machine, so each test run fuzzes and a failure can be repeated with --only.
//
//   velodyne_fuzz [--inputs N] [--seed S] [--only INDEX] [--max-bytes N] [--save FILE] FILE|FOLDER...
#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <unistd.h>

#include "core/standard_streams.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" void __sanitizer_set_death_callback(void (*callback)()) __attribute__((weak));

namespace {

using Bytes = std::vector<std::uint8_t>;

struct Options {
  std::uint64_t inputs = 2000;
  std::uint64_t seed = 1;
  std::uint64_t max_bytes = 65536;
  std::int64_t only = -1;
  std::string save;
  std::vector<std::filesystem::path> corpus;
};

volatile std::uint64_t g_index = 0;

/// Async-signal-safe: names the input that was running when the process died.
void report_death() {
  char text[96] = "fuzz: died on input; repeat with --only ";
  std::size_t end = std::strlen(text);
  char digits[24];
  std::size_t n = 0;
  std::uint64_t index = g_index;
  do digits[n++] = static_cast<char>('0' + index % 10);
  while (index /= 10);
  while (n) text[end++] = digits[--n];
  text[end++] = '\n';
  if (::write(STDERR_FILENO, text, end) < 0) return;
}
void on_signal(int signal) {
  report_death();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

Bytes read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

/// UDP payloads of a little-endian classic pcap over Ethernet: what a decoder sees. Parsed here on its own, so that the
/// fuzzed reader is not its own supplier. Up to `most`, spread over the file, at least one of each size.
std::vector<Bytes> pcap_payloads(const Bytes& file, std::size_t most) {
  std::vector<Bytes> all, kept;
  const auto u32 = [&](std::size_t at) {
    return std::uint32_t(file[at]) | std::uint32_t(file[at + 1]) << 8 | std::uint32_t(file[at + 2]) << 16 |
           std::uint32_t(file[at + 3]) << 24;
  };
  if (file.size() < 24 || u32(0) != 0xA1B2C3D4u) return kept;
  constexpr std::size_t kHeaders = 14 + 20 + 8;
  for (std::size_t at = 24; at + 16 <= file.size();) {
    const std::size_t length = u32(at + 8);
    at += 16;
    if (length > file.size() - at) break;
    if (length > kHeaders)
      all.emplace_back(file.begin() + static_cast<std::ptrdiff_t>(at + kHeaders),
                       file.begin() + static_cast<std::ptrdiff_t>(at + length));
    at += length;
  }
  std::vector<std::size_t> sizes;
  const std::size_t stride = all.size() / most + 1;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool is_new = std::find(sizes.begin(), sizes.end(), all[i].size()) == sizes.end();
    if (is_new) sizes.push_back(all[i].size());
    if (is_new || i % stride == 0) kept.push_back(std::move(all[i]));
  }
  return kept;
}

std::vector<Bytes> load_corpus(const Options& options) {
  std::vector<std::filesystem::path> files;
  for (const auto& path : options.corpus) {
    if (std::filesystem::is_directory(path)) {
      for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
        if (entry.is_regular_file()) files.push_back(entry.path());
    } else if (std::filesystem::exists(path)) {
      files.push_back(path);
    } else {
      std::fprintf(stderr, "fuzz: corpus not present: %s\n", path.c_str());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<Bytes> seeds;
  for (const auto& path : files) {
    Bytes bytes = read_file(path);
    for (Bytes& payload : pcap_payloads(bytes, 40)) seeds.push_back(std::move(payload));
    seeds.push_back(std::move(bytes));
  }
  return seeds;
}

class Mutator {
 public:
  Mutator(const std::vector<Bytes>& seeds, std::uint64_t seed, std::size_t max_bytes)
      : seeds_(seeds), random_(seed), max_bytes_(max_bytes) {}

  /// A piece of the corpus with 0 to 8 changes; sometimes plain noise.
  Bytes make() {
    Bytes input = below(50) == 0 || seeds_.empty() ? noise(below(2048)) : piece(pick());
    for (std::size_t changes = below(9); changes > 0; --changes) change(input);
    if (input.size() > max_bytes_) input.resize(max_bytes_);
    return input;
  }

 private:
  std::size_t below(std::size_t limit) { return limit ? static_cast<std::size_t>(random_() % limit) : 0; }
  const Bytes& pick() { return seeds_[below(seeds_.size())]; }
  Bytes noise(std::size_t size) {
    Bytes bytes(size);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random_());
    return bytes;
  }
  /// The whole seed, or a window of a long one: its beginning (file headers) or anywhere.
  Bytes piece(const Bytes& seed) {
    const std::size_t size = std::min(seed.size(), max_bytes_);
    const std::size_t from = seed.size() > size && below(2) ? below(seed.size() - size) : 0;
    const auto begin = seed.begin() + static_cast<std::ptrdiff_t>(from);
    return Bytes(begin, begin + static_cast<std::ptrdiff_t>(size));
  }
  static Bytes::iterator at(Bytes& bytes, std::size_t i) { return bytes.begin() + static_cast<std::ptrdiff_t>(i); }

  void change(Bytes& input) {
    // Near the start half of the time: that is where formats keep their lengths and counts.
    const std::size_t where = below(below(2) ? std::min<std::size_t>(input.size(), 128) : input.size());
    const std::size_t rest = input.size() - where;
    switch (below(8)) {
      case 0:
        if (rest) input[where] = static_cast<std::uint8_t>(input[where] ^ (1u << below(8)));
        break;
      case 1:
        if (rest) input[where] = static_cast<std::uint8_t>(random_());
        break;
      case 2: {  // limits, in 1, 2, 4 or 8 bytes of either order
        constexpr std::uint64_t limits[] = {0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, ~0ull};
        const std::uint64_t value = limits[below(std::size(limits))];
        const std::size_t width = std::min<std::size_t>(std::size_t{1} << below(4), rest);
        const bool reversed = below(2) == 1;
        for (std::size_t i = 0; i < width; ++i)
          input[where + i] = static_cast<std::uint8_t>(value >> (8 * (reversed ? width - 1 - i : i)));
        break;
      }
      case 3:
        input.resize(where);
        break;
      case 4: {
        const std::size_t n = std::min(below(64) + 1, rest);
        input.erase(at(input, where), at(input, where + n));
        break;
      }
      case 5: {
        const Bytes extra = noise(below(64));
        input.insert(at(input, where), extra.begin(), extra.end());
        break;
      }
      case 6: {  // repeat a piece of itself
        const Bytes copy(at(input, where), at(input, where + std::min<std::size_t>(below(256), rest)));
        input.insert(at(input, where), copy.begin(), copy.end());
        break;
      }
      default: {  // the end of another
        if (seeds_.empty()) break;
        const Bytes other = piece(pick());
        input.resize(where);
        input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(below(other.size())), other.end());
      }
    }
  }

  const std::vector<Bytes>& seeds_;
  std::mt19937_64 random_;
  std::size_t max_bytes_;
};

Options parse(std::span<char*> arguments) {
  Options options;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string word = arguments[i];
    const char* value = i + 1 < arguments.size() ? arguments[i + 1] : "";
    if (word == "--inputs")
      options.inputs = std::strtoull(value, nullptr, 10), ++i;
    else if (word == "--seed")
      options.seed = std::strtoull(value, nullptr, 10), ++i;
    else if (word == "--only")
      options.only = std::strtoll(value, nullptr, 10), ++i;
    else if (word == "--max-bytes")
      options.max_bytes = std::strtoull(value, nullptr, 10), ++i;
    else if (word == "--save")
      options.save = value, ++i;
    else
      options.corpus.emplace_back(word);
  }
  return options;
}

void run(const Bytes& input) {
  // An exact copy on the heap: reading one byte past it is what AddressSanitizer sees.
  const Bytes exact(input.begin(), input.end());
  LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

}  // namespace

int main(int argc, char** argv) {
  hueline::open_standard_streams();
  const Options options = parse({argv, static_cast<std::size_t>(argc)});
  const std::vector<Bytes> seeds = load_corpus(options);
  if (&__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(report_death);
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, on_signal);

  const std::uint64_t first = options.only >= 0 ? static_cast<std::uint64_t>(options.only) : 0;
  const std::uint64_t last = options.only >= 0 ? first + 1 : seeds.size() + options.inputs;
  std::uint64_t bytes = 0;
  for (std::uint64_t index = first; index < last; ++index) {
    g_index = index;
    // The unchanged corpus first, then the mutants; each has a random stream of its own, so --only needs no run-up.
    const Bytes input = index < seeds.size()
                            ? seeds[index]
                            : Mutator(seeds, options.seed * 0x9E3779B97F4A7C15ull + index, options.max_bytes).make();
    if (!options.save.empty() && options.only >= 0)
      std::ofstream(options.save, std::ios::binary)
          .write(reinterpret_cast<const char*>(input.data()), static_cast<std::streamsize>(input.size()));
    bytes += input.size();
    run(input);
  }
  std::printf("fuzz: %llu inputs, %llu bytes, %zu seeds%s, seed %llu: no failure\n",
              static_cast<unsigned long long>(last - first), static_cast<unsigned long long>(bytes), seeds.size(),
              seeds.empty() ? " (no corpus: noise only)" : "", static_cast<unsigned long long>(options.seed));
  return 0;
}
