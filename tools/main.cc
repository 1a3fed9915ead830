#include "revision.h"
#include "tools/program.h"

int main(int argument_count, char** arguments) {
  return lodestone::run_program(argument_count, arguments, LODESTONE_REVISION);
}
