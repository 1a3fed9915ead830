#pragma once

namespace cereal {
class BinaryInputArchive;
class BinaryOutputArchive;
}  // namespace cereal

namespace lodestone {

/// What a checkpoint is written to and read from: every number as it lies in memory, so that it comes back to the bit.
/// Whoever writes or reads includes core/checkpoint/serialization.h, in a .cpp.
using StateWriter = cereal::BinaryOutputArchive;
using StateReader = cereal::BinaryInputArchive;

}  // namespace lodestone
