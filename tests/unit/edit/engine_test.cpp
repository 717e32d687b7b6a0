#include "edit_support.h"
