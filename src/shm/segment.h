// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "corbot/channel/layout.h"
#include "shm/descriptor.h"
#include "shm/segment_error.h"

// Segments of shared memory: mapped memfds. For set-up and tear-down only, not real-time safe.

namespace corbot {

/// The required properties of a segment from another process.
struct SegmentExpectation {
  std::string_view robot;
  uid_t owner;  ///< the user whose process created it
  std::optional<std::uint64_t> fingerprint{};
};

namespace segment_detail {

/// Returns a memfd of that size, fully allocated: no later access can end in SIGBUS.
[[nodiscard]] Descriptor create(std::string_view robot, std::size_t size);
/// Fixes the size for good. `one_writer`: no process can map the memory for writing or write it any more.
void seal(const Descriptor& memory, std::string_view robot, bool one_writer);
/// Returns a second descriptor of the same memory, for reading.
[[nodiscard]] Descriptor open_read_only(const Descriptor& memory, std::string_view robot);
/// Throws SegmentError.
void check(const Descriptor& memory, const SegmentExpectation& expected, SegmentKind kind, std::size_t size);
void fill_header(SegmentHeader& header, std::string_view robot, std::uint64_t fingerprint, SegmentKind kind,
                 std::size_t size);
[[nodiscard]] void* map(const Descriptor& memory, std::size_t size, bool writable, std::string_view robot);
void unmap(void* address, std::size_t size) noexcept;

}  // namespace segment_detail

/// Throws kBadName.
void check_robot_name(std::string_view name);

/// One mapped segment with a descriptor to pass on. The descriptor of a segment with one writer is read-only.
/// `Layout` const: read-only; a write through it is a segmentation fault.
template <class Layout>
class Segment {
 public:
  using Plain = std::remove_const_t<Layout>;
  static constexpr bool kOneWriter = Plain::kKind != SegmentKind::kStop;

  /// Creates a segment that only this process can ever write (except the stop segment).
  [[nodiscard]] static Segment create(std::string_view robot,
                                      std::uint64_t fingerprint) requires(!std::is_const_v<Layout>) {
    using namespace segment_detail;
    Descriptor memory = segment_detail::create(robot, sizeof(Plain));
    Segment segment;
    segment.layout_ = ::new (map(memory, sizeof(Plain), true, robot)) Plain{};
    fill_header(segment.layout_->header, robot, fingerprint, Plain::kKind, sizeof(Plain));
    seal(memory, robot, kOneWriter);  // after the only mapping with write access
    segment.memory_ = kOneWriter ? open_read_only(memory, robot) : std::move(memory);
    return segment;
  }
  /// Maps another process's segment after checking it.
  [[nodiscard]] static Segment open(Descriptor memory,
                                    const SegmentExpectation& expected) requires(std::is_const_v<Layout> ||
                                                                                 !kOneWriter) {
    segment_detail::check(memory, expected, Plain::kKind, sizeof(Plain));
    Segment segment;
    segment.layout_ = static_cast<Plain*>(
        segment_detail::map(memory, sizeof(Plain), !std::is_const_v<Layout>, expected.robot));
    segment.memory_ = std::move(memory);
    return segment;
  }

  Segment(Segment&& other) noexcept
      : layout_(std::exchange(other.layout_, nullptr)), memory_(std::move(other.memory_)) {}
  Segment& operator=(Segment&& other) noexcept {
    std::swap(layout_, other.layout_);
    std::swap(memory_, other.memory_);
    return *this;
  }
  ~Segment() {
    if (layout_ != nullptr) segment_detail::unmap(layout_, sizeof(Plain));
  }

  [[nodiscard]] Layout& operator*() const noexcept { return *layout_; }
  [[nodiscard]] Layout* operator->() const noexcept { return layout_; }
  [[nodiscard]] const Descriptor& memory() const noexcept { return memory_; }

 private:
  Segment() = default;
  Plain* layout_{nullptr};
  Descriptor memory_;
};

}  // namespace corbot
