// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <type_traits>

#include "corbot/channel/atomics.h"
#include "explorer.h"

namespace corbot::model {

/// Stands for std::atomic: every access goes to the explorer.
template <class T>
class ModelAtomic {
  static_assert(std::is_same_v<T, std::uint64_t>);

 public:
  ModelAtomic(T initial = 0) : location_(Explorer::current().add_location(initial)) {}
  ModelAtomic(const ModelAtomic&) = delete;
  ModelAtomic& operator=(const ModelAtomic&) = delete;
  T load(std::memory_order order) const noexcept { return Explorer::current().load(location_, order); }
  void store(T value, std::memory_order order) noexcept {
    Explorer::current().store(location_, value, order);
  }

 private:
  std::size_t location_;
};

/// Stands for a plain variable: an access that nothing orders with a conflicting one ends the execution.
template <class T>
class ModelCell {
 public:
  void write(const T& from) noexcept {
    Explorer::current().write_cell(accesses_);
    value_ = from;
  }
  void read(T& to) const noexcept {
    Explorer::current().read_cell(accesses_);
    to = value_;
  }

 private:
  mutable Explorer::Accesses accesses_{};
  T value_{};
};

/// The orders of StdAtomics, on the model. A broken variant derives from it and hides one constant.
struct ModelAtomics : StdAtomics {
  template <class T>
  using Atomic = ModelAtomic<T>;
  template <class T>
  using Cell = ModelCell<T>;
  static constexpr int kCellAttempts = 2;
};

}  // namespace corbot::model
