#!/usr/bin/env tclsh
# SPDX-License-Identifier: Apache-2.0
# Test client of Corbot::Arm over Combat: reads a command a line, answers each with one line. It knows no operation by
# name; argument and result types come from corbot_ir.tcl beside it, which `prepare` makes from the IDL.

package require combat
source [file join [file dirname [info script]] corbot_ir.tcl]

combat::ir add {{module {IDL:omg.org/CosNaming:1.0 CosNaming 1.0} {
  {struct {IDL:omg.org/CosNaming/NameComponent:1.0 NameComponent 1.0} {{id string} {kind string}} {}}
  {interface {IDL:omg.org/CosNaming/NamingContext:1.0 NamingContext 1.0} {} {
    {enum {IDL:omg.org/CosNaming/NamingContext/NotFoundReason:1.0 NotFoundReason 1.0}
      {missing_node not_context not_object}}
    {exception {IDL:omg.org/CosNaming/NamingContext/NotFound:1.0 NotFound 1.0}
      {{why IDL:omg.org/CosNaming/NamingContext/NotFoundReason:1.0}
       {rest_of_name {sequence IDL:omg.org/CosNaming/NameComponent:1.0}}} {}}
    {exception {IDL:omg.org/CosNaming/NamingContext/InvalidName:1.0 InvalidName 1.0} {} {}}}}
  {interface {IDL:omg.org/CosNaming/NamingContextExt:1.0 NamingContextExt 1.0}
    {IDL:omg.org/CosNaming/NamingContext:1.0} {
    {operation {IDL:omg.org/CosNaming/NamingContextExt/resolve_str:1.0 resolve_str 1.0} Object {{in sn string}}
      {IDL:omg.org/CosNaming/NamingContext/NotFound:1.0 IDL:omg.org/CosNaming/NamingContext/InvalidName:1.0}}}}}}}

set arm_id IDL:Corbot/Arm:1.0

proc narrow {reference id} {
  if {$reference eq "0" || ![$reference _is_a $id]} {
    corba::throw {IDL:omg.org/CORBA/BAD_PARAM:1.0 {minor 0 completion_status COMPLETED_NO}}
  }
  return $reference
}

# What Combat knows of an operation (Op) or attribute (Attr) of the arm, a dictionary. Its public commands do not tell.
proc description {kind name} {
  if {![info exists ::arm]} {error "not connected"}
  ::Combat::SimpleTypeRepository::HaveTypeInfoForId $::arm_id
  set found [::Combat::SimpleTypeRepository::get$kind $::arm_id $name]
  if {$found eq ""} {error "no [dict get {Op operation Attr attribute} $kind] $name"}
  return $found
}

proc invoke {type command} {
  set result [uplevel #0 $command]
  return [expr {$type eq "void" ? "ok" : "ok [text $type $result]"}]
}

# The command that calls the operation in the text, and the type of its result.
proc operation {text options} {
  set words [regexp -all -inline {\S+} [regsub -all {[][{}]} $text { & }]]
  set words [lassign $words name]
  set operation [description Op $name]
  set values {}
  foreach parameter [dict get $operation parameters] {lappend values [value [dict get $parameter type] words]}
  if {[llength $words]} {error "too many arguments"}
  return [list [dict get $operation result] [list $::arm {*}$options $name {*}$values]]
}

proc next {words_variable} {
  upvar 1 $words_variable words
  if {![llength $words]} {error "too few arguments"}
  set words [lassign $words word]
  return $word
}

proc expect {bracket words_variable} {
  upvar 1 $words_variable words
  set word [next words]
  if {$word ne $bracket} {error "expected $bracket instead of $word"}
}

# Takes an argument of this type off the words.
proc value {type words_variable} {
  upvar 1 $words_variable words
  switch -- [lindex $type 0] {
    double {return [number [next words]]}
    long {return [whole [next words] -2147483648 2147483647]}
    unsigned {return [whole [next words] 0 18446744073709551615]}
    string - enum {return [next words]}
    sequence {
      set elements {}
      expect \[ words
      while {[lindex $words 0] ne "\]"} {lappend elements [value [lindex $type 1] words]}
      expect \] words
      return $elements
    }
    struct {
      set members {}
      expect \{ words
      foreach {name member} [lindex $type 2] {lappend members $name [value $member words]}
      expect \} words
      return $members
    }
  }
  error "no arguments of type $type"
}

# Combat computes the bits of a double, and not always rightly: it would send inf as 0, 7.9999999999999991 as 131072.
proc number {word} {
  if {![string is double -strict $word]} {error "$word is no number"}
  set buffer [::Combat::CDR::WriteBuffer #auto]
  set is_sent [expr {![catch {$buffer double $word}] && [binary scan [$buffer get_data] d sent] && $sent == $word}]
  itcl::delete object $buffer
  if {!$is_sent} {error "Combat cannot send $word"}
  return $word
}

# Combat would cut an integer that is too large.
proc whole {word least most} {
  if {![string is entier -strict $word] || $word < $least || $word > $most} {
    error "$word is no whole number from $least to $most"
  }
  return $word
}

proc text {type value} {
  switch -- [lindex $type 0] {
    double {return [format %.17g $value]}
    boolean {return [expr {$value ? "true" : "false"}]}
    unsigned {return [expr {$value & 0xffffffffffffffff}]}
    string {return \"[string map {\\ \\\\ \" \\\"} $value]\"}
    Object - interface {return [corba::object_to_string $value]}
    sequence {return \[[join [lmap element $value {text [lindex $type 1] $element}]]\]}
    struct - exception {
      return \{[join [lmap {name member} [lindex $type 2] {string cat $name= [text $member [dict get $value $name]]}]]\}
    }
  }
  return $value
}

# What to answer when Combat or this client has raised an error with this message.
proc failure {message} {
  if {![regexp {^(IDL:(\S*/)?([^/\s]+):[\d.]+)( |$)} $message -> id scope name]} {return "error $message"}
  if {$scope eq "omg.org/CORBA/"} {return "exception SYSTEM:$name"}
  return "exception $name [text [corba::type of $id] [lindex $message 1]]"
}

proc answer {line} {
  lassign [regexp -inline {^\s*(\S*)\s*(\S*)\s*(.*)$} $line] - command first rest
  switch -- $command {
    connect {set ::arm [narrow [corba::string_to_object $first] $::arm_id]}
    resolve {
      set context [narrow [corba::string_to_object $first] IDL:omg.org/CosNaming/NamingContextExt:1.0]
      set ::arm [narrow [$context resolve_str $rest] $::arm_id]
    }
    get {return [invoke [dict get [description Attr $first] type] [list $::arm $first]]}
    call {return [invoke {*}[operation "$first $rest" {}]]}
    begin {
      lassign [operation $rest -async] type command
      set ::begun($first) [list $type [list corba::request get [uplevel #0 $command]]]
    }
    end {
      if {![info exists ::begun($first)]} {error "nothing was begun as $first"}
      set call $::begun($first)
      unset ::begun($first)
      return [invoke {*}$call]
    }
    default {error "no command $command"}
  }
  return ok
}

# Between commands the event loop runs, so that what was begun goes on; during a command standard input waits.
while 1 {
  fileevent stdin readable {set readable 1}
  vwait readable
  fileevent stdin readable {}
  if {[gets stdin line] < 0} {exit}
  if {[catch {answer $line} result]} {set result [failure $result]}
  puts [string map {\n " "} $result]
  flush stdout
}
