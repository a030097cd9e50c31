// SPDX-License-Identifier: Apache-2.0
#include "support/ior.h"

#include <cstdint>
#include <cstring>
#include <stdexcept>

#include <fmt/core.h>

namespace corbot::test {
namespace {

constexpr std::uint32_t kInternetIop = 0;

/// CDR in an encapsulation, in either byte order; alignment counts from its start, where the order stands.
class Reader {
 public:
  explicit Reader(std::string bytes) : bytes_(std::move(bytes)) { little_ = octet() != 0; }
  std::uint8_t octet() { return static_cast<std::uint8_t>(taken(1)[0]); }
  std::uint32_t u16() { return number(2); }
  std::uint32_t u32() { return number(4); }
  std::string octets() {
    const std::uint32_t length = u32();
    return taken(length);
  }
  std::string text() {
    std::string value = octets();
    value.pop_back();
    return value;
  }

 private:
  std::uint32_t number(std::size_t size) {
    at_ = (at_ + size - 1) / size * size;
    const std::string raw = taken(size);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8 | static_cast<std::uint8_t>(raw[little_ ? size - 1 - i : i]);
    return value;
  }
  std::string taken(std::size_t count) {
    if (bytes_.size() - at_ < count || count == 0)
      throw std::invalid_argument("a reference that ends too early");
    at_ += count;
    return bytes_.substr(at_ - count, count);
  }
  std::string bytes_;
  std::size_t at_{0};
  bool little_{true};
};

class IorWriter {
 public:
  void octet(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  void u16(std::uint32_t value) { number(value, 2); }
  void u32(std::uint32_t value) { number(value, 4); }
  void octets(const std::string& value) {
    u32(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
  }
  void text(const std::string& value) { octets(value + '\0'); }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  void number(std::uint32_t value, std::size_t size) {
    while (bytes_.size() % size != 0) bytes_.push_back('\0');
    for (std::size_t i = 0; i < size; ++i) octet(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  std::string bytes_{'\1'};  // little-endian
};

}  // namespace

Ior parse_ior(const std::string& text) {
  constexpr std::size_t kPrefix = 4;  // "IOR:"
  std::string bytes;
  for (std::size_t i = kPrefix; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<char>(std::stoi(text.substr(i, 2), nullptr, 16)));
  Reader reader(bytes);
  Ior ior;
  ior.type = reader.text();
  for (std::uint32_t left = reader.u32(); left > 0; --left) {
    const bool is_iiop = reader.u32() == kInternetIop;
    Reader profile(reader.octets());
    if (!is_iiop) continue;
    (void)profile.octet();
    (void)profile.octet();
    ior.host = profile.text();
    ior.port = static_cast<int>(profile.u16());
    ior.key = profile.octets();
    return ior;
  }
  throw std::invalid_argument("a reference without an IIOP profile");
}

std::string to_string(const Ior& ior) {
  IorWriter profile;
  profile.octet(1);
  profile.octet(2);
  profile.text(ior.host);
  profile.u16(static_cast<std::uint32_t>(ior.port));
  profile.octets(ior.key);
  profile.u32(0);  // no components
  IorWriter all;
  all.text(ior.type);
  all.u32(1);
  all.u32(kInternetIop);
  all.octets(profile.bytes());
  std::string text = "IOR:";
  for (const char c : all.bytes()) text += fmt::format("{:02x}", static_cast<std::uint8_t>(c));
  return text;
}

}  // namespace corbot::test
