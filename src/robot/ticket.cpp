// SPDX-License-Identifier: Apache-2.0
#include "robot/ticket.h"

namespace corbot {

TicketState state_of(Verdict verdict) {
  if (verdict == Verdict::kDone) return TicketState::kDone;
  return verdict == Verdict::kStopped ? TicketState::kStopped : TicketState::kFailed;
}

TicketReason reason_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kDone:
      return TicketReason::kNone;
    case Verdict::kStopped:
    case Verdict::kFault:
    case Verdict::kMalformed:
    case Verdict::kDiscontinuous:
    case Verdict::kLimit:
    case Verdict::kLost:
    case Verdict::kOrphaned:
    case Verdict::kDropped:
    case Verdict::kEnded:
      return static_cast<TicketReason>(verdict);
  }
  return TicketReason::kUnknown;
}

const char* to_string(TicketReason reason) {
  switch (reason) {
    case TicketReason::kNone:
      return "";
    case TicketReason::kStopped:
      return "stopped by Stop or StopAndHold";
    case TicketReason::kFault:
      return "the robot went into Error";
    case TicketReason::kMalformed:
      return "the real-time task refused the command: a field is invalid";
    case TicketReason::kDiscontinuous:
      return "the motion planned before this one did not arrive where this one begins";
    case TicketReason::kLimit:
      return "the real-time task refused the command: beyond a limit of the arm";
    case TicketReason::kLost:
      return "the real-time task was restarted; the motion was lost with the old one";
    case TicketReason::kOrphaned:
      return "no servant responded: the motion was stopped on its path";
    case TicketReason::kDropped:
      return "the motion was not begun: its data from the servant was damaged";
    case TicketReason::kEnded:
      return "the real-time task was ended: the motion was stopped on its path, or not begun";
    case TicketReason::kTakenBack:
      return "taken back by Cancel";
    case TicketReason::kRecordLost:
      return "the motion has ended, but the record of how it ended was lost";
    case TicketReason::kTaskGone:
      return "the real-time task was gone before the motion had ended";
    case TicketReason::kUnknown:
      break;
  }
  return "the real-time task gave an unknown verdict";
}

bool is_consistent(TicketState state, TicketReason reason) {
  switch (state) {
    case TicketState::kPending:
    case TicketState::kDone:
      return reason == TicketReason::kNone;
    case TicketState::kStopped:
      return reason == TicketReason::kStopped || reason == TicketReason::kTakenBack;
    case TicketState::kFailed:
      break;
    default:
      return false;
  }
  switch (reason) {
    case TicketReason::kFault:
    case TicketReason::kMalformed:
    case TicketReason::kDiscontinuous:
    case TicketReason::kLimit:
    case TicketReason::kLost:
    case TicketReason::kOrphaned:
    case TicketReason::kDropped:
    case TicketReason::kEnded:
    case TicketReason::kRecordLost:
    case TicketReason::kTaskGone:
    case TicketReason::kUnknown:
      return true;
    case TicketReason::kNone:
    case TicketReason::kStopped:
    case TicketReason::kTakenBack:
    default:
      return false;
  }
}

TicketRecord to_record(const Ticket& ticket) {
  TicketRecord record{};
  record.first = ticket.first;
  record.last = ticket.last;
  record.duration_s = ticket.duration_s;
  record.second_from_s = ticket.second_from_s;
  record.incarnation = ticket.incarnation;
  record.epoch = ticket.epoch;
  record.end_q = ticket.end.position_q;
  record.end_gripper = ticket.end.gripper;
  record.handed_until = ticket.handed_until;
  record.state = ticket.state;
  record.reason = ticket.why;
  record.cancelled = ticket.cancelled ? 1 : 0;
  return record;
}

Ticket to_ticket(const TicketRecord& record) {
  Ticket ticket;
  ticket.first = record.first;
  ticket.last = record.last;
  ticket.duration_s = record.duration_s;
  ticket.second_from_s = record.second_from_s;
  ticket.incarnation = record.incarnation;
  ticket.epoch = record.epoch;
  ticket.end = {record.end_q, record.end_gripper};
  ticket.cancelled = record.cancelled == 1;
  ticket.state = record.state;
  ticket.why = record.reason;
  ticket.reason = to_string(record.reason);
  return ticket;
}

}  // namespace corbot
