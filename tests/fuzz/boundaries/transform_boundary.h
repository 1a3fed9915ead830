#pragma once

#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

#include "frontends/configuration/text_file.h"
#include "frontends/messages/static_transforms.h"
#include "frontends/messages/wire_cdr.h"
#include "frontends/messages/wire_ros1.h"

namespace lodestone::testing {

/// A chain of static transforms.
template <Encoding encoding>
void write_transforms(const std::filesystem::path& folder) {
  std::conditional_t<encoding == Encoding::cdr, CdrWireWriter, Ros1WireWriter> wire;
  wire.number(std::uint32_t{3});
  for (const char* parent : {"a", "b", "c"}) {
    wire.header(0, parent);
    wire.text(std::string(1, static_cast<char>(*parent + 1)));
    for (const double value : {1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0}) wire.number(value);
  }
  const std::vector<std::uint8_t> bytes = wire.take();
  write_text_file((folder / "message").string(), std::string(bytes.begin(), bytes.end()));
}
template <Encoding encoding>
void read_transforms_of_message(const std::filesystem::path& folder) {
  const std::string text = read_text_file((folder / "message").string());
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  StaticTransforms transforms;
  add_transforms("log", {"/tf_static", "tf2_msgs/TFMessage", encoding, 0, 0, 0, "", ""},
                 {0, 0, bytes.data(), bytes.size()}, transforms);
  transforms.between("a", "d");
}

}  // namespace lodestone::testing
