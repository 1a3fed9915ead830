// With any bytes altered or missing, an input is either read, or refused in one line; no other exception is thrown.
#include "tests/fuzz/boundaries/boundaries.h"

#include <gtest/gtest.h>

#include <random>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using testing::Boundary;
using testing::TemporaryFolder;

class EachBoundary : public ::testing::TestWithParam<Boundary> {};

std::string altered(std::string bytes, std::mt19937_64& random) {
  const auto place = [&] { return bytes.empty() ? 0 : random() % bytes.size(); };
  for (std::uint64_t changes = 1 + random() % 6; changes > 0; --changes) {
    const std::size_t at = random() % 2 == 0 ? place() : std::min<std::size_t>(place() % 512, bytes.size());
    const std::size_t length = std::min<std::size_t>(1 + random() % 8, bytes.size() - at);
    switch (random() % 7) {
      case 0:  // a few bits
        if (length > 0) bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
        break;
      case 1:  // the largest numbers
        for (std::size_t i = 0; i < length; ++i) bytes[at + i] = static_cast<char>(0xFF);
        break;
      case 2:
        for (std::size_t i = 0; i < length; ++i) bytes[at + i] = static_cast<char>(random());
        break;
      case 3:  // lost
        bytes.erase(at, length);
        break;
      case 4:  // duplicated
        bytes.insert(at, bytes.substr(at, 64));
        break;
      case 5:  // digits
        if (length > 0) bytes[at] = static_cast<char>('0' + random() % 10);
        break;
      default: {
        static const char* const words[] = {
            "-", "nan", "1e309", "99999999999999999999", "\n", ": [", "&a *a", "\0", "{}", "~", "..", "\t"};
        bytes.insert(at, words[random() % std::size(words)]);
      }
    }
  }
  if (random() % 12 == 0) bytes.resize(place());
  return bytes;
}

TEST_P(EachBoundary, ReadsTheValidAndRefusesTheAlteredInOneLine) {
  const TemporaryFolder folder;
  GetParam().write(folder.path());
  ASSERT_NO_THROW(GetParam().read(folder.path()));
  const std::string file = folder / GetParam().file;
  const std::string valid = read_text_file(file);
  int refused = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937_64 random(seed);
    std::ofstream(file, std::ios::binary) << altered(valid, random);
    try {
      GetParam().read(folder.path());
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "seed " << seed << ": " << error.what();
      ++refused;
    } catch (const std::exception& error) {
      ADD_FAILURE() << "seed " << seed << ": " << typeid(error).name() << ": " << error.what();
    }
  }
  EXPECT_GT(refused, 0);
  RecordProperty("refused", refused);
}

INSTANTIATE_TEST_SUITE_P(Inputs, EachBoundary, ::testing::ValuesIn(testing::boundaries()),
                         [](const auto& info) { return info.param.name; });

/// Inputs found by fuzzers, read again: the sanitizers detect the former defects.
TEST(FoundInputs, AreReadOrRefusedInOneLine) {
  struct Found {
    std::string boundary;
    std::string bytes;
  };
  std::string empty_livox(43, '\0');  // a Livox message without points: no first point to count offsets from
  empty_livox[0] = static_cast<char>(0x95);
  empty_livox[22] = static_cast<char>(0x80);
  // A header that continues after its end, with more fields than memory was allocated for.
  const std::string twice =
      "VERSION 0.7\nFIELDS x y z intensity ring t\nSIZE 4 4 4 4 2 4\nTYPE F F F F U U\nCOUNT 1 1 1 1 1 1\nWIDTH "
      "2\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\nFIELDS-1e\nWIDTH 90000\nDATA ascii\nFIELDS-1e-2001  0 0\n"
      "1 2 3 4 5 6\n1 2 3 4 5 6\n";
  const std::string far_future = "name: late\nstart_time_s: 17400000000\n";  // its nanoseconds overflow 64 bits
  for (const Found& found : {Found{"world", far_future}, Found{"message_cdr", empty_livox}, Found{"csv_cloud", twice},
                             Found{"cloud_ascii", twice}}) {
    const TemporaryFolder folder;
    const Boundary& boundary = testing::boundary(found.boundary);
    boundary.write(folder.path());
    std::ofstream(folder / boundary.file, std::ios::binary) << found.bytes;
    try {
      boundary.read(folder.path());
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace lodestone
