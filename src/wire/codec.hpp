#pragma once
/// LCM bytes <-> structs. The public header of the folder.
///
/// Incoming  wire/decode.hpp: every length is checked before it is believed, every field before it is used.
/// Outgoing  wire/encode.hpp: fills message objects that are used again, so that a running service needs no heap.
/// Streams   wire/tspi_guard.hpp: what is wrong with a series of good messages.
/// Doors     wire/link_gate.hpp: how many, and with which tag (wire/signed.hpp); before decoding.
#include "wire/channels.hpp"
#include "wire/decode.hpp"
#include "wire/encode.hpp"
#include "wire/messages.hpp"
#include "wire/tspi_guard.hpp"
