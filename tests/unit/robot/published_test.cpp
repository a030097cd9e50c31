// SPDX-License-Identifier: Apache-2.0
// A reader of a published pointer never finds its object gone, and a writer that replaces the pointer does
// not wait for ever.
#include "robot/published.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace corbot::test::published_test {
namespace {

struct Value {
  ~Value() { is_alive = false; }
  std::atomic<bool> is_alive{true};
};

TEST(Published, IsNullAtFirst) {
  const Published<Value> published;
  EXPECT_TRUE(published.read([](const Value* value) { return value == nullptr; }));
}

TEST(Published, WaitsForWhoReadsTheFormerPointer) {
  Published<Value> published;
  Value first;
  Value second;
  published.replace(&first);
  std::atomic<bool> is_reading{false};
  std::atomic<bool> ends{false};
  std::atomic<bool> is_replaced{false};
  std::thread reader([&] {
    (void)published.read([&](const Value* value) {
      is_reading = true;
      while (!ends) std::this_thread::yield();
      return value == &first;
    });
  });
  while (!is_reading) std::this_thread::yield();
  std::thread writer([&] {
    published.replace(&second);
    is_replaced = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(is_replaced);
  EXPECT_TRUE(published.read([&](const Value* value) { return value == &second; })) << "others go on";
  ends = true;
  reader.join();
  writer.join();
}

TEST(Published, NeverNamesWhatIsGoneAndReadersDoNotHoldUpWhoReplacesIt) {
  Published<Value> published;
  std::atomic<bool> ends{false};
  std::atomic<int> gone{0};
  std::vector<std::thread> readers;
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&] {
      while (!ends)
        gone += published.read([](const Value* value) { return value != nullptr && !value->is_alive; });
    });
  }
  std::unique_ptr<Value> now;
  for (int i = 0; i < 500; ++i) {
    auto next = i % 10 == 0 ? nullptr : std::make_unique<Value>();
    published.replace(next.get());
    now = std::move(next);
  }
  published.replace(nullptr);
  ends = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(gone, 0);
}

}  // namespace
}  // namespace corbot::test::published_test
