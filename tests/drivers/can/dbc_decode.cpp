// Decodes frames by a DBC file, for dbc_canmatrix_test.py: reads lines "ID EXTENDED HEX", writes a line of
// "name<tab>raw<tab>value<tab>word" fields for each, separated by "\x1f".
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/can/dbc.hpp"

int main(int argc, char** argv) {
  using namespace hueline;
  if (argc != 2) return 2;
  std::ifstream file(argv[1], std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const drivers::Dbc dbc = drivers::read_dbc(text);
  for (const std::string& trouble : dbc.troubles) std::fprintf(stderr, "%s\n", trouble.c_str());
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream in(line);
    unsigned id = 0;
    int is_extended = 0;
    std::string hex;
    in >> id >> is_extended >> hex;
    std::vector<std::uint8_t> data;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
      data.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
    if (const drivers::DbcMessage* message = dbc.find(id, is_extended != 0))
      for (const drivers::DbcValue& v : drivers::decode(*message, data)) {
        const bool is_negative = v.signal->signal.is_signed;
        std::printf("%s\t", v.signal->name.c_str());
        if (is_negative)
          std::printf("%lld", static_cast<long long>(v.raw));
        else
          std::printf("%llu", static_cast<unsigned long long>(v.raw));
        std::printf("\t%.17g\t%s\x1f", v.value, v.word ? v.word->c_str() : "");
      }
    std::printf("\n");
  }
  return 0;
}
