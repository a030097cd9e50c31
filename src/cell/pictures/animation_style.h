// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace corbot::cell {

// The palette of M. Okabe and K. Ito, distinct for most colour-blind people, and tints of it.
inline constexpr const char* kAnimationStyle =
    "text{font:20px system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;fill:#24292f}"
    ".dim{fill:#59636e}.panel{fill:#fff;stroke:#d0d7de}.table{fill:#f3f4f6}"
    ".place{fill:#fff;stroke:#9aa4af;stroke-width:2}.area{stroke-dasharray:9 7}"
    ".slot{fill:none;stroke:#c3cad2;stroke-width:2}.rule{fill:none;stroke:#59636e;stroke-width:2}"
    ".track{fill:#e6e9ed}.now{stroke:#24292f;stroke-width:3;stroke-linecap:round}"
    ".link{fill:none;stroke-linecap:round;stroke-linejoin:round}.shade{stroke:#000;opacity:.1}"
    ".piece{fill:#30363d}.mark{fill:#fff}"
    ".e0{stroke:#0072b2}.b0{stroke:#a9d5f2}.f0{fill:#0072b2}.e1{stroke:#00805e}.b1{stroke:#9adbc5}"
    ".f1{fill:#00805e}.e2{stroke:#a8578a}.b2{stroke:#ecc3da}.f2{fill:#a8578a}.e3{stroke:#b57d00}"
    ".b3{stroke:#f6d78f}.f3{fill:#b57d00}"
    "@media(prefers-color-scheme:dark){text{fill:#e6edf3}.dim{fill:#9aa4af}"
    ".panel{fill:#0d1117;stroke:#30363d}.table{fill:#161b22}.place{fill:#0d1117;stroke:#6e7781}"
    ".slot{stroke:#3d444d}.rule{stroke:#9aa4af}.track{fill:#21262d}.now{stroke:#e6edf3}"
    ".shade{opacity:.35}.piece{fill:#d0d7de}.e0{stroke:#56b4e9}.b0{stroke:#1f4e6e}.f0{fill:#56b4e9}"
    ".e1{stroke:#2fc79b}.b1{stroke:#12503d}.f1{fill:#2fc79b}.e2{stroke:#e39bc3}.b2{stroke:#5e3450}"
    ".f2{fill:#e39bc3}.e3{stroke:#e69f00}.b3{stroke:#5f4407}.f3{fill:#e69f00}}";
inline constexpr std::size_t kArmColours = 4;

struct LabelColour {
  double hue_deg;
  const char* text;
};
inline constexpr std::array<LabelColour, 6> kLabelColours{{{20, "#d55e00"},
                                                           {50, "#f0e442"},
                                                           {130, "#009e73"},
                                                           {195, "#56b4e9"},
                                                           {230, "#0072b2"},
                                                           {320, "#cc79a7"}}};

}  // namespace corbot::cell
