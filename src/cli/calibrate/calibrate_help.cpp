// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/calibrate_help.h"

namespace corbot::cli {

const char* calibrate_help() {
  return "  on              give the servos their pulses: THE ARM MAY JUMP; keep clear\n"
         "  yes             answer to 'on', where it takes the servos to stored angles\n"
         "  joint NAME|N    choose a servo; 'joint gripper' the gripper's\n"
         "  + US, - US      turn it by so many microseconds, at 200 us a second\n"
         "  goto US         turn it to a pulse width\n"
         "  mark VALUE      the joint stands there now, degrees, or mm where it slides; two marks\n"
         "                  far apart give zero_us, us_per_degree (us_per_mm) and direction,\n"
         "                  one moves zero_us only\n"
         "  mark open, mark closed    the same for the gripper\n"
         "  limit low, limit high     the joint's range ends here\n"
         "  undo            take the last mark or limit back\n"
         "  show            what has been found so far\n"
         "  write           change the numbers in the profile; the old one becomes FILE.bak\n"
         "  quit            end; what is not written is lost\n";
}

}  // namespace corbot::cli
