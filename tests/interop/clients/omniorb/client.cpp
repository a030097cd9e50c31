// SPDX-License-Identifier: Apache-2.0
// Test client of Corbot::Arm over omniORB: reads a command a line, answers each with one line.
#include <fmt/format.h>
#include <omniORB4/Naming.hh>

#include <algorithm>
#include <arm.hh>
#include <functional>
#include <future>
#include <iostream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "texts.h"

namespace {

using Words = std::istringstream;

// ---- Arguments: taken off the words by type ------------------------------------------------------------
double number(Words& words) {
  std::string word;
  if (!(words >> word)) throw std::invalid_argument("too few arguments");
  std::size_t used = 0;
  const double value = std::stod(word, &used);
  if (used != word.size()) throw std::invalid_argument(word + " is no number");
  return value;
}

void expect(Words& words, const std::string& bracket) {
  std::string word;
  if (!(words >> word) || word != bracket) throw std::invalid_argument("expected " + bracket);
}

/// As what an argument is kept during the call.
template <class Argument>
using Kept = std::conditional_t<std::is_same_v<Argument, const char*>, std::string, std::decay_t<Argument>>;

template <class Type>
Type argument(Words& words) {
  if constexpr (std::is_same_v<Type, std::string>) {
    std::string word;
    if (!(words >> word)) throw std::invalid_argument("too few arguments");
    return word;
  } else if constexpr (std::is_same_v<Type, Corbot::Point>) {
    expect(words, "{");
    const double x = number(words);
    const double y = number(words);
    const double z = number(words);
    expect(words, "}");
    return {x, y, z};
  } else if constexpr (std::is_same_v<Type, Corbot::Quaternion>) {
    expect(words, "{");
    const double w = number(words);
    const double x = number(words);
    const double y = number(words);
    const double z = number(words);
    expect(words, "}");
    return {w, x, y, z};
  } else if constexpr (std::is_same_v<Type, Corbot::Pose>) {
    expect(words, "{");
    const auto position = argument<Corbot::Point>(words);
    const auto orientation = argument<Corbot::Quaternion>(words);
    expect(words, "}");
    return {position, orientation};
  } else if constexpr (std::is_same_v<Type, Corbot::OffsetFrame>) {
    const std::string word = argument<std::string>(words);
    if (word == "OffsetInBase") return Corbot::OffsetInBase;
    if (word == "OffsetInTool") return Corbot::OffsetInTool;
    throw std::invalid_argument(word + " is no frame");
  } else if constexpr (std::is_same_v<Type, Corbot::JointCoord>) {
    expect(words, "[");
    Corbot::JointCoord joints;
    while ((words >> std::ws).peek() != ']') {
      joints.length(joints.length() + 1);
      joints[joints.length() - 1] = number(words);
    }
    expect(words, "]");
    return joints;
  } else if constexpr (std::is_same_v<Type, Corbot::JointRanges>) {
    expect(words, "[");
    Corbot::JointRanges ranges;
    while ((words >> std::ws).peek() != ']') {
      ranges.length(ranges.length() + 1);
      expect(words, "{");
      ranges[ranges.length() - 1].lower = number(words);
      ranges[ranges.length() - 1].upper = number(words);
      expect(words, "}");
    }
    expect(words, "]");
    return ranges;
  } else {
    return static_cast<Type>(number(words));
  }
}

// ---- The interface -------------------------------------------------------------------------------------
using Stub = Corbot::_objref_Arm;
using Call = std::function<std::string(Corbot::Arm_ptr, Words&)>;

CORBA::ORB_ptr orb() {
  static const CORBA::ORB_var instance = [] {
    int argc = 0;
    return CORBA::ORB_init(argc, nullptr);
  }();
  return instance;
}

/// As the operations take it.
const char* passed(const std::string& text) { return text.c_str(); }
template <class Type>
const Type& passed(const Type& value) {
  return value;
}

template <class Class, class Result, class... Arguments>
Call call_of(Result (Class::*operation)(Arguments...)) {
  return [operation](Corbot::Arm_ptr arm, Words& words) -> std::string {
    // A braced list is evaluated from left to right.
    std::tuple<Kept<Arguments>...> arguments{argument<Kept<Arguments>>(words)...};
    std::string rest;
    if (words >> rest) throw std::invalid_argument("too many arguments");
    return std::apply(
        [&](const auto&... values) -> std::string {
          if constexpr (std::is_void_v<Result>) {
            (arm->*operation)(passed(values)...);
            return "ok";
          } else if constexpr (std::is_same_v<Result, Corbot::Arm_ptr>) {
            const Corbot::Arm_var result((arm->*operation)(passed(values)...));
            return "ok " + std::string(CORBA::String_var(orb()->object_to_string(result)).in());
          } else if constexpr (std::is_same_v<Result, char*>) {
            const CORBA::String_var result = (arm->*operation)(passed(values)...);
            return "ok " + text(result.in());
          } else if constexpr (std::is_pointer_v<Result>) {
            const std::unique_ptr<std::remove_pointer_t<Result>> result((arm->*operation)(passed(values)...));
            return "ok " + text(*result);
          } else {
            return "ok " + text((arm->*operation)(passed(values)...));
          }
        },
        arguments);
  };
}

#define CALL(name) \
  { #name, call_of(&Stub::name) }
const std::map<std::string, Call> kCalls{CALL(ArtiCoord),
                                         CALL(CartCoord),
                                         CALL(GripperStatus),
                                         CALL(Status),
                                         CALL(RobotType),
                                         CALL(DoF),
                                         CALL(MovRange),
                                         CALL(Reach),
                                         CALL(Move),
                                         CALL(MoveS),
                                         CALL(MoveC),
                                         CALL(Drive),
                                         CALL(Ready),
                                         CALL(Delay),
                                         CALL(Open),
                                         CALL(Close),
                                         CALL(Speed),
                                         CALL(ArtSpeed),
                                         CALL(AllSpeed),
                                         CALL(Stop),
                                         CALL(Cancel),
                                         CALL(Pause),
                                         CALL(Resume),
                                         CALL(Override),
                                         CALL(OverridePercent),
                                         CALL(Clear),
                                         CALL(StartMove),
                                         CALL(StartMoveS),
                                         CALL(StartMoveC),
                                         CALL(StartDrive),
                                         CALL(StartMoveJoints),
                                         CALL(StartReady),
                                         CALL(StartDelay),
                                         CALL(StartOpen),
                                         CALL(StartClose),
                                         CALL(Wait),
                                         CALL(Progress),
                                         CALL(MoveJoints),
                                         CALL(SetToolPitch),
                                         CALL(ToolPitch),
                                         CALL(Alarms),
                                         CALL(Diagnostics),
                                         CALL(Device),
                                         CALL(Servant),
                                         CALL(StopAndHold),
                                         CALL(Acquire),
                                         CALL(Renew),
                                         CALL(Release),
                                         CALL(Control),
                                         CALL(CycleAge),
                                         CALL(Description),
                                         CALL(State),
                                         CALL(SetGripper),
                                         CALL(StartSetGripper),
                                         CALL(Gripper),
                                         CALL(MovePose),
                                         CALL(MovePoseS),
                                         CALL(StartMovePose),
                                         CALL(StartMovePoseS),
                                         CALL(MoveRelative),
                                         CALL(MoveRelativeS),
                                         CALL(StartMoveRelative),
                                         CALL(StartMoveRelativeS),
                                         CALL(SetToolOrientation),
                                         CALL(ResetToolOrientation),
                                         CALL(ToolOrientation),
                                         CALL(SetToolFrame),
                                         CALL(SetBaseFrame),
                                         CALL(ResetFrames),
                                         CALL(Solutions),
                                         CALL(PlanMove),
                                         CALL(PlanMoveS),
                                         CALL(PlanMoveC),
                                         CALL(PlanDrive),
                                         CALL(PlanMoveJoints),
                                         CALL(PlanReady),
                                         CALL(PlanMovePose),
                                         CALL(PlanMovePoseS),
                                         CALL(PlanMoveRelative),
                                         CALL(PlanMoveRelativeS),
                                         CALL(Joints),
                                         CALL(ToolFrame),
                                         CALL(BaseFrame),
                                         CALL(Solution),
                                         CALL(SetSoftLimits),
                                         CALL(ResetSoftLimits),
                                         CALL(SoftLimits),
                                         CALL(ResetWorkspace),
                                         CALL(Workspace)};
#undef CALL

// ---- Exceptions ----------------------------------------------------------------------------------------
std::string answered(const std::function<std::string()>& body) {
  try {
    return body();
  } catch (const Corbot::BadParameter& e) {
    return "exception BadParameter " + members(std::pair("parameter", (const char*)e.parameter),
                                               std::pair("value", e.value),
                                               std::pair("reason", (const char*)e.reason));
  } catch (const Corbot::Unreachable& e) {
    return "exception Unreachable " +
           members(std::pair("target", e.target), std::pair("reason", (const char*)e.reason));
  } catch (const Corbot::LimitExceeded& e) {
    return "exception LimitExceeded " +
           members(std::pair("quantity", (const char*)e.quantity), std::pair("articulation", e.articulation),
                   std::pair("value", e.value), std::pair("lower", e.lower), std::pair("upper", e.upper));
  } catch (const Corbot::NotReady& e) {
    return "exception NotReady " + members(std::pair("reason", (const char*)e.reason));
  } catch (const Corbot::Stopped& e) {
    return "exception Stopped " + members(std::pair("reason", (const char*)e.reason));
  } catch (const Corbot::QueueFull& e) {
    return "exception QueueFull " + members(std::pair("capacity", e.capacity));
  } catch (const CORBA::SystemException& e) {
    return fmt::format("exception SYSTEM:{}", e._name());
  } catch (const CORBA::Exception& e) {
    return fmt::format("exception {} {{}}", e._name());
  } catch (const std::exception& e) {
    return fmt::format("error {}", e.what());
  }
}

class Client {
 public:
  std::string answer(const std::string& line) {
    return answered([&] { return carry_out(line); });
  }

 private:
  std::string carry_out(const std::string& line) {
    Words words(spaced(line));
    std::string command;
    std::string first;
    words >> command >> first;
    if (command == "connect") {
      narrow(CORBA::Object_var(orb()->string_to_object(first.c_str())));
      return "ok";
    }
    if (command == "resolve") {
      std::string name;
      words >> name;
      CORBA::Object_var object = orb()->string_to_object(first.c_str());
      CosNaming::NamingContextExt_var context = CosNaming::NamingContextExt::_narrow(object);
      narrow(CORBA::Object_var(context->resolve_str(name.c_str())));
      return "ok";
    }
    if (command == "get" || command == "call") return call(first, words);
    if (command == "begin") {
      std::string rest;
      std::getline(words, rest);
      begun_[first] = std::async(std::launch::async, [this, rest] { return answer("call" + rest); });
      return "ok";
    }
    if (command == "end") {
      const auto found = begun_.find(first);
      if (found == begun_.end()) throw std::invalid_argument("nothing was begun as " + first);
      const std::string result = found->second.get();
      begun_.erase(found);
      return result;
    }
    throw std::invalid_argument("no command " + command);
  }
  std::string call(const std::string& name, Words& words) {
    const auto found = kCalls.find(name);
    if (found == kCalls.end()) throw std::invalid_argument("no operation " + name);
    return found->second(arm_, words);
  }
  void narrow(CORBA::Object_ptr object) {
    arm_ = Corbot::Arm::_narrow(object);
    if (CORBA::is_nil(arm_)) throw CORBA::BAD_PARAM();
  }
  static std::string spaced(const std::string& line) {
    std::string result;
    for (const char c : line) {
      result +=
          std::string("{}[]").find(c) == std::string::npos ? std::string(1, c) : std::string(" ") + c + " ";
    }
    return result;
  }

  Corbot::Arm_var arm_;
  std::map<std::string, std::future<std::string>> begun_;
};

}  // namespace

int main() {
  Client client;
  for (std::string line; std::getline(std::cin, line);) {
    std::string answer = client.answer(line);
    std::replace(answer.begin(), answer.end(), '\n', ' ');
    std::cout << answer << std::endl;
  }
}
