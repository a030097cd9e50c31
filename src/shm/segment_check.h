// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "corbot/channel/layout.h"
#include "shm/segment_file.h"

// What lies in a segment's file, before anything of it is trusted. Set-up only, not real-time safe.
// Used by segment.h.

namespace corbot::segment_detail {

/// A shared mapping of the whole layout.
class Mapping {
 public:
  Mapping() = default;
  Mapping(const File& file, int protection, std::string_view name);
  Mapping(Mapping&& other) noexcept : layout_(std::exchange(other.layout_, nullptr)) {}
  Mapping& operator=(Mapping&& other) noexcept {
    std::swap(layout_, other.layout_);
    return *this;
  }
  ~Mapping();
  [[nodiscard]] SegmentLayout* get() const noexcept { return layout_; }

 private:
  SegmentLayout* layout_{nullptr};
};

/// Has a creator not come, or not come back, to finish it? Only such a file may be initialised: empty, or of
/// the full size with the magic still zero.
[[nodiscard]] bool is_unborn(const File& file, std::string_view name);

/// Before mapping: the size, so that no access can end in SIGBUS, and with it the magic and the version, so
/// that the refusal says what it is rather than how long it is.
void check_size(const File& file, std::string_view name);

/// After mapping. The acquire load of the magic pairs with the creator's release store: all else in the
/// header is initialised.
void check_header(const SegmentLayout& layout, std::string_view name,
                  std::optional<std::uint64_t> fingerprint);

/// In a fresh, zeroed file. The magic comes last.
void initialise(SegmentLayout* memory, std::string_view name, std::uint64_t fingerprint) noexcept;

}  // namespace corbot::segment_detail
