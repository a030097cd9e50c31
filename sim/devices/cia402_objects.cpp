// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/cia402_objects.h"

#include <limits>
#include <utility>

#include "sim/devices/process_data.h"

namespace corbot::sim {
namespace {

constexpr std::int64_t kSyncId = 0x080;
constexpr std::int64_t kEmergencyObject = 0x080;

constexpr std::int64_t kHighest = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t kLowest = std::numeric_limits<std::int32_t>::min();

CanObject constant(unsigned bytes, std::int64_t value) { return {.bytes = bytes, .value = value}; }
CanObject text(std::string value) { return {.bytes = 0, .text = std::move(value)}; }
CanObject writable(unsigned bytes, std::int64_t value, std::int64_t lowest, std::int64_t highest) {
  return {.bytes = bytes,
          .is_signed = lowest < 0,
          .access = Access::kReadWrite,
          .value = value,
          .lowest = lowest,
          .highest = highest};
}
CanObject input(CanObject object) {
  object.goes_into_rpdo = true;
  return object;
}
CanObject output(unsigned bytes, bool is_signed) {
  return {.bytes = bytes, .is_signed = is_signed, .goes_into_tpdo = true};
}

void add_pdo(CanObjects& objects, std::uint8_t node, std::size_t number) {
  const auto n = static_cast<ObjectKey>(number);
  const std::int64_t off = number == 0 ? 0 : std::int64_t{1} << 31;
  // From the factory the first PDO carries the word alone, as in CiA 402; the others are off.
  for (const bool is_received : {true, false}) {
    const ObjectKey parameters = (is_received ? 0x1400u : 0x1800u) + n;
    const ObjectKey mapping = (is_received ? 0x1600u : 0x1A00u) + n;
    const std::int64_t id = (is_received ? 0x200 : 0x180) + 0x100 * static_cast<std::int64_t>(n) + node;
    objects.add(parameters << 8, constant(1, 2));
    objects.add(parameters << 8 | 1, writable(4, off | id, 0, 0xFFFF'FFFF));
    objects.add(parameters << 8 | 2, writable(1, 255, 0, 255));
    objects.add(mapping << 8, writable(1, number == 0 ? 1 : 0, 0, ProcessData::kMostEntries));
    for (ObjectKey sub = 1; sub <= ProcessData::kMostEntries; ++sub) {
      const bool is_first = number == 0 && sub == 1;
      objects.add(mapping << 8 | sub, writable(4,
                                               !is_first     ? 0
                                               : is_received ? 0x6040'0010
                                                             : 0x6041'0010,
                                               0, 0xFFFF'FFFF));
    }
  }
}

}  // namespace

void add_communication_objects(CanObjects& objects, std::uint8_t node) {
  objects.add(0x100000, constant(4, 0x0002'0192));  // a servo drive, profile 402
  objects.add(0x100100, output(1, false));
  objects.add(0x100500, writable(4, kSyncId, 0, 0x7FF));
  objects.add(0x100600, writable(4, 0, 0, 0xFFFF'FFFF));
  objects.add(0x100800, text("corbot emulated drive"));
  objects.add(0x100900, text("1"));
  objects.add(0x100A00, text("1.0"));
  objects.add(0x101400, constant(4, kEmergencyObject + node));
  objects.add(0x101600, constant(1, 1));
  objects.add(0x101601, writable(4, 0, 0, 0xFFFF'FFFF));
  objects.add(0x101700, writable(2, 0, 0, 0xFFFF));
  objects.add(0x101800, constant(1, 4));
  for (ObjectKey sub = 1; sub <= 4; ++sub) objects.add(0x101800 + sub, constant(4, sub == 4 ? node : 0));
  for (std::size_t number = 0; number < ProcessData::kPdos; ++number) add_pdo(objects, node, number);
}

void add_drive_objects(CanObjects& objects, std::uint8_t node) {
  add_communication_objects(objects, node);
  objects.add(0x600700, writable(2, 1, 0, 3));
  objects.add(0x603F00, output(2, false));
  objects.add(0x604000, input(writable(2, 0, 0, 0xFFFF)));
  objects.add(0x604100, output(2, false));
  objects.add(0x605A00, writable(2, 2, -1, 6));
  objects.add(0x606000, input(writable(1, 0, -1, 10)));
  objects.add(0x606100, output(1, true));
  objects.add(0x606200, output(4, true));
  objects.add(0x606400, output(4, true));
  objects.add(0x606500, writable(4, 20'000, 0, 0xFFFF'FFFF));
  objects.add(0x606600, writable(2, 50, 0, 0xFFFF));
  objects.add(0x607900, constant(4, 48'000));  // mV of the DC link
  objects.add(0x607A00, input(writable(4, 0, kLowest, kHighest)));
  objects.add(0x607C00, writable(4, 0, kLowest, kHighest));
  objects.add(0x607D00, constant(1, 2));
  objects.add(0x607D01, writable(4, kLowest, kLowest, kHighest));
  objects.add(0x607D02, writable(4, kHighest, kLowest, kHighest));
  objects.add(0x608500, writable(4, 5'000'000, 1, 0xFFFF'FFFF));
  objects.add(0x609800, writable(1, 0, -128, 127));
  objects.add(0x609900, constant(1, 2));
  objects.add(0x609901, writable(4, 5'000, 1, 0xFFFF'FFFF));
  objects.add(0x609902, writable(4, 1'000, 1, 0xFFFF'FFFF));
  objects.add(0x609A00, writable(4, 50'000, 1, 0xFFFF'FFFF));
  objects.add(0x60C200, constant(1, 2));
  objects.add(0x60C201, writable(1, 1, 1, 255));
  objects.add(0x60C202, writable(1, -3, -6, 0));
  objects.add(0x60F400, output(4, true));
  objects.add(0x650200, constant(4, 1 << 7 | 1 << 5));
}

}  // namespace corbot::sim
